//! Files of parallel HDF5, through the library that PETSc is linked with.
//!
//! The functions are looked up in the libraries of the process. So HDF5 and PETSc use one MPI, and a
//! PETSc without HDF5 is found when a case asks for such a file, not when the program is built.

use super::threads::address;
use crate::error::{Error, Result, agree};
use mpi::topology::SimpleCommunicator;
use mpi::traits::AsRaw;
use petsc_sys::MPI_Comm;
use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

/// Identifier of an object of HDF5 since version 1.10.
type Handle = i64;
/// Negative if a function failed.
type Code = c_int;

/// The default property list, and the selection of everything.
const DEFAULT: Handle = 0;
/// Size of a dimension that may grow.
const UNLIMITED: u64 = u64::MAX;

/// The library that parallel files need, as a message names it.
const CURE: &str = "use a PETSc that is linked with parallel HDF5 1.10 or newer, such as that of the Debian \
                    package petsc-dev with libhdf5-openmpi-dev, or write `format: vtu`";

/// Declares a table of C functions that are found by name.
macro_rules! functions {
    ($($name:ident($($argument:ty),*) -> $result:ty;)*) => {
        /// The functions of HDF5, and identifiers that it defines when it starts.
        #[allow(non_snake_case, reason = "the names of the C library")]
        struct Library {
            $($name: unsafe extern "C" fn($($argument),*) -> $result,)*
        }

        impl Library {
            /// Finds all functions; the name of the first missing one otherwise.
            fn find(address: impl Fn(&CStr) -> Option<*mut c_void>) -> std::result::Result<Self, String> {
                Ok(Self {$(
                    $name: {
                        let name = concat!(stringify!($name), "\0");
                        let name = CStr::from_bytes_with_nul(name.as_bytes()).unwrap_or_default();
                        let found = address(name).ok_or_else(|| stringify!($name).to_owned())?;
                        // SAFETY: the function of this name has this signature in HDF5 1.10 and newer.
                        unsafe { std::mem::transmute::<*mut c_void, unsafe extern "C" fn($($argument),*) -> $result>(found) }
                    },
                )*})
            }
        }
    };
}

functions! {
    H5open() -> Code;
    H5get_libversion(*mut c_uint, *mut c_uint, *mut c_uint) -> Code;
    H5Eset_auto2(Handle, *const c_void, *mut c_void) -> Code;
    H5Ewalk2(Handle, c_int, unsafe extern "C" fn(c_uint, *const ErrorEntry, *mut c_void) -> Code, *mut c_void) -> Code;
    H5Pcreate(Handle) -> Handle;
    H5Pclose(Handle) -> Code;
    H5Pset_fapl_mpio(Handle, MPI_Comm, mpi::ffi::MPI_Info) -> Code;
    H5Pset_all_coll_metadata_ops(Handle, bool) -> Code;
    H5Pset_coll_metadata_write(Handle, bool) -> Code;
    H5Pset_dxpl_mpio(Handle, c_int) -> Code;
    H5Pset_chunk(Handle, c_int, *const u64) -> Code;
    H5Pset_fill_time(Handle, c_int) -> Code;
    H5Fcreate(*const c_char, c_uint, Handle, Handle) -> Handle;
    H5Fopen(*const c_char, c_uint, Handle) -> Handle;
    H5Fflush(Handle, c_int) -> Code;
    H5Fclose(Handle) -> Code;
    H5Gcreate2(Handle, *const c_char, Handle, Handle, Handle) -> Handle;
    H5Gclose(Handle) -> Code;
    H5Gget_info_by_name(Handle, *const c_char, *mut GroupInfo, Handle) -> Code;
    H5Lexists(Handle, *const c_char, Handle) -> Code;
    H5Oopen(Handle, *const c_char, Handle) -> Handle;
    H5Oclose(Handle) -> Code;
    H5Acreate2(Handle, *const c_char, Handle, Handle, Handle, Handle) -> Handle;
    H5Aopen(Handle, *const c_char, Handle) -> Handle;
    H5Awrite(Handle, Handle, *const c_void) -> Code;
    H5Aread(Handle, Handle, *mut c_void) -> Code;
    H5Aget_space(Handle) -> Handle;
    H5Aclose(Handle) -> Code;
    H5Screate(c_int) -> Handle;
    H5Screate_simple(c_int, *const u64, *const u64) -> Handle;
    H5Sselect_hyperslab(Handle, c_int, *const u64, *const u64, *const u64, *const u64) -> Code;
    H5Sselect_none(Handle) -> Code;
    H5Sget_simple_extent_ndims(Handle) -> c_int;
    H5Sget_simple_extent_dims(Handle, *mut u64, *mut u64) -> c_int;
    H5Sclose(Handle) -> Code;
    H5Tcopy(Handle) -> Handle;
    H5Tequal(Handle, Handle) -> Code;
    H5Tset_size(Handle, usize) -> Code;
    H5Tset_strpad(Handle, c_int) -> Code;
    H5Tclose(Handle) -> Code;
    H5Dcreate2(Handle, *const c_char, Handle, Handle, Handle, Handle, Handle) -> Handle;
    H5Dopen2(Handle, *const c_char, Handle) -> Handle;
    H5Dset_extent(Handle, *const u64) -> Code;
    H5Dget_space(Handle) -> Handle;
    H5Dget_type(Handle) -> Handle;
    H5Dwrite(Handle, Handle, Handle, Handle, Handle, *const c_void) -> Code;
    H5Dread(Handle, Handle, Handle, Handle, Handle, *mut c_void) -> Code;
    H5Dclose(Handle) -> Code;
}

/// An entry of HDF5's stack of errors (`H5E_error2_t`).
#[repr(C)]
struct ErrorEntry {
    class: Handle,
    major: Handle,
    minor: Handle,
    line: c_uint,
    function: *const c_char,
    file: *const c_char,
    description: *const c_char,
}

/// Information on a group (`H5G_info_t`).
#[repr(C)]
#[derive(Default)]
struct GroupInfo {
    storage: c_int,
    links: u64,
    largest_order: i64,
    is_mounted: bool,
}

/// The library with the identifiers that it defines when it starts.
struct Hdf5 {
    functions: Library,
    of_files: Handle,
    of_datasets: Handle,
    of_transfers: Handle,
    text: Handle,
    float64: Handle,
    int64: Handle,
    int32: Handle,
    uint8: Handle,
}

/// The library; it is found and started at the first use.
fn library() -> Result<&'static Hdf5> {
    static FOUND: OnceLock<std::result::Result<Hdf5, String>> = OnceLock::new();
    FOUND.get_or_init(|| start(address)).as_ref().map_err(|reason| {
        Error::file(format!("files in the format vtkhdf need parallel HDF5, but {reason}")).hint(CURE)
    })
}

fn start(address: impl Fn(&CStr) -> Option<*mut c_void>) -> std::result::Result<Hdf5, String> {
    let functions = Library::find(&address)
        .map_err(|name| format!("PETSc is linked without it (there is no function {name})"))?;
    let [mut major, mut minor, mut patch] = [0; 3];
    // SAFETY: the function writes three numbers. Null pointers turn off the printing of errors.
    let is_started = unsafe {
        (functions.H5open)() >= 0
            && (functions.H5get_libversion)(&mut major, &mut minor, &mut patch) >= 0
            && (functions.H5Eset_auto2)(DEFAULT, null(), null_mut()) >= 0
    };
    if !is_started {
        return Err("it does not start".to_owned());
    }
    if (major, minor) < (1, 10) {
        return Err(format!("PETSc is linked with HDF5 {major}.{minor}.{patch}"));
    }
    let value = |name: &CStr| {
        let found = address(name).ok_or_else(|| format!("there is no {name:?}"))?;
        // SAFETY: these variables of the library are handles, which it has set when it started.
        Ok::<_, String>(unsafe { *found.cast::<Handle>() })
    };
    Ok(Hdf5 {
        of_files: value(c"H5P_CLS_FILE_ACCESS_ID_g")?,
        of_datasets: value(c"H5P_CLS_DATASET_CREATE_ID_g")?,
        of_transfers: value(c"H5P_CLS_DATASET_XFER_ID_g")?,
        text: value(c"H5T_C_S1_g")?,
        float64: value(c"H5T_NATIVE_DOUBLE_g")?,
        int64: value(c"H5T_NATIVE_INT64_g")?,
        int32: value(c"H5T_NATIVE_INT32_g")?,
        uint8: value(c"H5T_NATIVE_UINT8_g")?,
        functions,
    })
}

/// Checks that this process has parallel HDF5.
///
/// # Errors
/// PETSc is not linked with it, or it is too old; the hint names the Debian package.
pub fn require_hdf5() -> Result<()> {
    library().map(|_| ())
}

/// The innermost description on HDF5's stack of errors.
unsafe extern "C" fn innermost(_: c_uint, entry: *const ErrorEntry, text: *mut c_void) -> Code {
    // SAFETY: HDF5 passes an entry that is valid during the call, and the pointer of the caller.
    unsafe {
        let text = &mut *text.cast::<String>();
        if text.is_empty() && !entry.is_null() && !(*entry).description.is_null() {
            *text = CStr::from_ptr((*entry).description).to_string_lossy().into_owned();
        }
    }
    0
}

/// The description of the last error.
fn reason(library: &Library) -> String {
    let mut text = String::new();
    // SAFETY: the callback has the signature of the library, and `text` lives during the call.
    unsafe { (library.H5Ewalk2)(DEFAULT, 0, innermost, (&raw mut text).cast()) };
    if text.is_empty() { "no reason given".to_owned() } else { text }
}

/// An object that is closed when its owner is dropped.
struct Owned {
    handle: Handle,
    close: unsafe extern "C" fn(Handle) -> Code,
}

impl Owned {
    fn new(
        library: &Library,
        what: &str,
        handle: Handle,
        close: unsafe extern "C" fn(Handle) -> Code,
    ) -> Result<Self> {
        if handle < 0 {
            return Err(Error::file(format!("can not {what}: HDF5: {}", reason(library))));
        }
        Ok(Self { handle, close })
    }

    fn close(self, library: &Library, what: &str) -> Result<()> {
        let own = std::mem::ManuallyDrop::new(self);
        // SAFETY: the handle is open, and `ManuallyDrop` keeps it from being closed again.
        done(library, what, unsafe { (own.close)(own.handle) })
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: the handle is open and is closed by the function of its kind.
        unsafe { (self.close)(self.handle) };
    }
}

fn done(library: &Library, what: &str, code: Code) -> Result<()> {
    if code >= 0 {
        return Ok(());
    }
    Err(Error::file(format!("can not {what}: HDF5: {}", reason(library))))
}

fn c_text(text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::file(format!("{text:?}: HDF5 takes no name with a zero")))
}

/// Type of the numbers of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberType {
    /// Physical quantities.
    Float64,
    /// Sizes and offsets.
    Int64,
    /// Counts.
    Int32,
    /// Codes.
    UInt8,
}

impl NumberType {
    /// Size of a number.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Float64 | Self::Int64 => 8,
            Self::Int32 => 4,
            Self::UInt8 => 1,
        }
    }
}

/// Rows of numbers, one row after the other.
#[derive(Debug, Clone, Copy)]
pub enum Rows<'a> {
    /// Physical quantities.
    Float64(&'a [f64]),
    /// Sizes and offsets.
    Int64(&'a [i64]),
    /// Counts.
    Int32(&'a [i32]),
    /// Codes.
    UInt8(&'a [u8]),
}

impl Rows<'_> {
    /// The type of the numbers.
    pub fn number_type(&self) -> NumberType {
        match self {
            Self::Float64(_) => NumberType::Float64,
            Self::Int64(_) => NumberType::Int64,
            Self::Int32(_) => NumberType::Int32,
            Self::UInt8(_) => NumberType::UInt8,
        }
    }

    /// Number of numbers.
    pub fn len(&self) -> usize {
        match self {
            Self::Float64(values) => values.len(),
            Self::Int64(values) => values.len(),
            Self::Int32(values) => values.len(),
            Self::UInt8(values) => values.len(),
        }
    }

    /// Whether the list is empty, as on a rank that owns nothing.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn pointer(&self) -> *const c_void {
        match self {
            Self::Float64(values) => values.as_ptr().cast(),
            Self::Int64(values) => values.as_ptr().cast(),
            Self::Int32(values) => values.as_ptr().cast(),
            Self::UInt8(values) => values.as_ptr().cast(),
        }
    }
}

/// Number of numbers per row: a list has one, a table several.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// A dataset of one dimension.
    List,
    /// A dataset of two dimensions.
    Table(u64),
}

impl Width {
    /// Number of numbers in a row.
    pub fn numbers(self) -> u64 {
        match self {
            Self::List => 1,
            Self::Table(width) => width,
        }
    }

    fn sizes(self, rows: u64) -> [u64; 2] {
        [rows, self.numbers()]
    }

    fn dimensions(self) -> c_int {
        match self {
            Self::List => 1,
            Self::Table(_) => 2,
        }
    }
}

/// A file that all ranks have open. All functions are collective, and their errors are the same on all
/// ranks.
pub struct Hdf5File<'a> {
    hdf5: &'static Hdf5,
    path: PathBuf,
    world: &'a SimpleCommunicator,
    transfer: Owned,
    file: Owned,
    /// HDF5 is used by one thread.
    _single: PhantomData<*const ()>,
}

impl<'a> Hdf5File<'a> {
    /// Creates a file, or empties an existing one. Collective.
    ///
    /// # Errors
    /// There is no parallel HDF5, or the disk can not be written.
    pub fn create(world: &'a SimpleCommunicator, path: &Path) -> Result<Self> {
        Self::begin(world, path, "create", |hdf5, name, access| {
            // SAFETY: `H5F_ACC_TRUNC` with the default creation; the name ends with a zero.
            unsafe { (hdf5.functions.H5Fcreate)(name.as_ptr(), 2, DEFAULT, access) }
        })
    }

    /// Opens an existing file to read and write. Collective.
    ///
    /// # Errors
    /// There is no parallel HDF5, no such file, or it is damaged.
    pub fn open(world: &'a SimpleCommunicator, path: &Path) -> Result<Self> {
        Self::begin(world, path, "open", |hdf5, name, access| {
            // SAFETY: `H5F_ACC_RDWR`; the name ends with a zero.
            unsafe { (hdf5.functions.H5Fopen)(name.as_ptr(), 1, access) }
        })
    }

    fn begin(
        world: &'a SimpleCommunicator,
        path: &Path,
        what: &str,
        open: impl Fn(&Hdf5, &CStr, Handle) -> Handle,
    ) -> Result<Self> {
        let prepared = library().and_then(|hdf5| {
            let functions = &hdf5.functions;
            let name =
                c_text(path.to_str().ok_or_else(|| {
                    Error::file(format!("{}: HDF5 needs a path in UTF-8", path.display()))
                })?)?;
            // SAFETY: the class exists since the library has started.
            let access = unsafe { (functions.H5Pcreate)(hdf5.of_files) };
            let access = Owned::new(functions, "create a property list", access, functions.H5Pclose)?;
            // SAFETY: the list is open; the communicator and the empty information are those of MPI.
            let code = unsafe {
                (functions.H5Pset_fapl_mpio)(access.handle, world.as_raw(), mpi::ffi::RSMPI_INFO_NULL)
                    .min((functions.H5Pset_all_coll_metadata_ops)(access.handle, true))
                    .min((functions.H5Pset_coll_metadata_write)(access.handle, true))
            };
            done(functions, "use MPI for files", code)?;
            // SAFETY: the class exists; 1 is `H5FD_MPIO_COLLECTIVE`.
            let transfer = unsafe { (functions.H5Pcreate)(hdf5.of_transfers) };
            let transfer = Owned::new(functions, "create a property list", transfer, functions.H5Pclose)?;
            // SAFETY: the list is open.
            done(functions, "write together", unsafe { (functions.H5Pset_dxpl_mpio)(transfer.handle, 1) })?;
            Ok((hdf5, name, access, transfer))
        });
        let (hdf5, name, access, transfer) = agree(world, prepared)?;
        let functions = &hdf5.functions;
        let opened = Owned::new(functions, what, open(hdf5, &name, access.handle), functions.H5Fclose);
        let opened = opened.map_err(|error| error.within(&path.display().to_string()));
        let file = agree(world, opened)?;
        Ok(Self { hdf5, path: path.to_owned(), world, transfer, file, _single: PhantomData })
    }

    fn agreed<T>(&self, own: Result<T>) -> Result<T> {
        agree(self.world, own.map_err(|error| error.within(&self.path.display().to_string())))
    }

    /// Writes to the disk what the library holds in memory. Collective.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn flush(&self) -> Result<()> {
        // SAFETY: the file is open; 1 is `H5F_SCOPE_GLOBAL`.
        let code = unsafe { (self.hdf5.functions.H5Fflush)(self.file.handle, 1) };
        self.agreed(done(&self.hdf5.functions, "flush", code))
    }

    /// Closes the file. Collective.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn close(self) -> Result<()> {
        let Self { hdf5, path, world, file, .. } = self;
        let closed = file.close(&hdf5.functions, "close").map_err(|e| e.within(&path.display().to_string()));
        agree(world, closed)
    }

    /// Creates a group.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn create_group(&self, name: &str) -> Result<()> {
        let functions = &self.hdf5.functions;
        let made = c_text(name).and_then(|text| {
            // SAFETY: the file is open, the name ends with a zero, all lists are the default ones.
            let group =
                unsafe { (functions.H5Gcreate2)(self.file.handle, text.as_ptr(), DEFAULT, DEFAULT, DEFAULT) };
            Owned::new(functions, &format!("create {name}"), group, functions.H5Gclose).map(|_| ())
        });
        self.agreed(made)
    }

    /// Whether the group that contains it has an object of this name.
    ///
    /// # Errors
    /// The containing group does not exist, or the file is damaged.
    pub fn has(&self, name: &str) -> Result<bool> {
        let functions = &self.hdf5.functions;
        let found = c_text(name).and_then(|text| {
            // SAFETY: the file is open, and the name ends with a zero.
            let code = unsafe { (functions.H5Lexists)(self.file.handle, text.as_ptr(), DEFAULT) };
            done(functions, &format!("look for {name}"), code).map(|()| code > 0)
        });
        self.agreed(found)
    }

    /// Number of groups and datasets in a group.
    ///
    /// # Errors
    /// There is no such group.
    pub fn members(&self, group: &str) -> Result<u64> {
        let functions = &self.hdf5.functions;
        let found = c_text(group).and_then(|text| {
            let mut info = GroupInfo::default();
            // SAFETY: the file is open, the name ends with a zero, and the record is the library's.
            let code = unsafe {
                (functions.H5Gget_info_by_name)(self.file.handle, text.as_ptr(), &raw mut info, DEFAULT)
            };
            done(functions, &format!("look into {group}"), code).map(|()| info.links)
        });
        self.agreed(found)
    }

    /// Gives a group an attribute that is a text of fixed length in ASCII.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn set_text(&self, group: &str, name: &str, text: &str) -> Result<()> {
        let functions = &self.hdf5.functions;
        let written = (|| {
            // SAFETY: the type of text exists, and its copy is open; 1 is `H5T_STR_NULLPAD`.
            let kind = unsafe { (functions.H5Tcopy)(self.hdf5.text) };
            let kind = Owned::new(functions, "copy a type", kind, functions.H5Tclose)?;
            // SAFETY: as above.
            let code = unsafe {
                (functions.H5Tset_size)(kind.handle, text.len())
                    .min((functions.H5Tset_strpad)(kind.handle, 1))
            };
            done(functions, "size a text", code)?;
            // SAFETY: 0 is `H5S_SCALAR`.
            let space = unsafe { (functions.H5Screate)(0) };
            let space = Owned::new(functions, "create a space", space, functions.H5Sclose)?;
            self.create_attribute(group, name, &kind, &space, text.as_ptr().cast())
        })();
        self.agreed(written)
    }

    fn object(&self, name: &str) -> Result<Owned> {
        let functions = &self.hdf5.functions;
        let text = c_text(name)?;
        // SAFETY: the file is open, and the name ends with a zero.
        let found = unsafe { (functions.H5Oopen)(self.file.handle, text.as_ptr(), DEFAULT) };
        Owned::new(functions, &format!("open {name}"), found, functions.H5Oclose)
    }

    /// `values` has as many numbers of `kind` as `space`.
    fn create_attribute(
        &self,
        group: &str,
        name: &str,
        kind: &Owned,
        space: &Owned,
        values: *const c_void,
    ) -> Result<()> {
        let functions = &self.hdf5.functions;
        let group = self.object(group)?;
        let text = c_text(name)?;
        // SAFETY: all handles are open, and the name ends with a zero.
        let attribute = unsafe {
            let [kind, space] = [kind.handle, space.handle];
            (functions.H5Acreate2)(group.handle, text.as_ptr(), kind, space, DEFAULT, DEFAULT)
        };
        let attribute =
            Owned::new(functions, &format!("create attribute {name}"), attribute, functions.H5Aclose)?;
        // SAFETY: the caller passes a value of the type and size of the attribute.
        let code = unsafe { (functions.H5Awrite)(attribute.handle, kind.handle, values) };
        done(functions, &format!("write attribute {name}"), code)
    }

    /// Gives a group an attribute of integers: a list, or a scalar if there is one number.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn set_integers(&self, group: &str, name: &str, values: &[i64]) -> Result<()> {
        let functions = &self.hdf5.functions;
        let written = (|| {
            let count = values.len() as u64;
            // SAFETY: 0 is `H5S_SCALAR`; otherwise the space has one dimension, of which the size is given.
            let space = unsafe {
                match values {
                    [_] => (functions.H5Screate)(0),
                    _ => (functions.H5Screate_simple)(1, &raw const count, null()),
                }
            };
            let space = Owned::new(functions, "create a space", space, functions.H5Sclose)?;
            // SAFETY: the type exists.
            let kind = unsafe { (functions.H5Tcopy)(self.hdf5.int64) };
            let kind = Owned::new(functions, "copy a type", kind, functions.H5Tclose)?;
            self.create_attribute(group, name, &kind, &space, values.as_ptr().cast())
        })();
        self.agreed(written)
    }

    fn attribute(&self, group: &str, name: &str) -> Result<Owned> {
        let functions = &self.hdf5.functions;
        let group = self.object(group)?;
        let text = c_text(name)?;
        // SAFETY: the group is open, and the name ends with a zero.
        let found = unsafe { (functions.H5Aopen)(group.handle, text.as_ptr(), DEFAULT) };
        Owned::new(functions, &format!("open attribute {name}"), found, functions.H5Aclose)
    }

    /// Changes an attribute that is one integer.
    ///
    /// # Errors
    /// There is no such attribute, or the disk can not be written.
    pub fn change_integer(&self, group: &str, name: &str, value: i64) -> Result<()> {
        let functions = &self.hdf5.functions;
        let changed = self.attribute(group, name).and_then(|attribute| {
            let value: *const i64 = &raw const value;
            // SAFETY: the attribute is a scalar that `set_integers` created.
            let code = unsafe { (functions.H5Awrite)(attribute.handle, self.hdf5.int64, value.cast()) };
            done(functions, &format!("write attribute {name}"), code)
        });
        self.agreed(changed)
    }

    /// Reads an attribute that is one integer.
    ///
    /// # Errors
    /// There is no such attribute.
    pub fn integer(&self, group: &str, name: &str) -> Result<i64> {
        let functions = &self.hdf5.functions;
        let read = self.attribute(group, name).and_then(|attribute| {
            // SAFETY: the attribute is open.
            let space = unsafe { (functions.H5Aget_space)(attribute.handle) };
            let space = Owned::new(functions, "size an attribute", space, functions.H5Sclose)?;
            // SAFETY: the space is open.
            if unsafe { (functions.H5Sget_simple_extent_ndims)(space.handle) } != 0 {
                return Err(Error::file(format!("attribute {name} is not one number")));
            }
            let mut value = 0_i64;
            // SAFETY: the attribute is one number, which the library converts to this type.
            let code =
                unsafe { (functions.H5Aread)(attribute.handle, self.hdf5.int64, (&raw mut value).cast()) };
            done(functions, &format!("read attribute {name}"), code).map(|()| value)
        });
        self.agreed(read)
    }

    fn kind(&self, kind: NumberType) -> Handle {
        match kind {
            NumberType::Float64 => self.hdf5.float64,
            NumberType::Int64 => self.hdf5.int64,
            NumberType::Int32 => self.hdf5.int32,
            NumberType::UInt8 => self.hdf5.uint8,
        }
    }

    /// Creates an empty dataset whose number of rows may change. The disk space grows by `chunk` rows.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn create_dataset(&self, name: &str, kind: NumberType, width: Width, chunk: u64) -> Result<()> {
        let functions = &self.hdf5.functions;
        let made =
            (|| {
                let text = c_text(name)?;
                let none = width.sizes(0);
                let most = width.sizes(UNLIMITED);
                let chunk = width.sizes(chunk.max(1));
                // SAFETY: the arrays have an entry for each dimension.
                let space =
                    unsafe { (functions.H5Screate_simple)(width.dimensions(), none.as_ptr(), most.as_ptr()) };
                let space = Owned::new(functions, "create a space", space, functions.H5Sclose)?;
                // SAFETY: the class exists since the library has started.
                let list = unsafe { (functions.H5Pcreate)(self.hdf5.of_datasets) };
                let list = Owned::new(functions, "create a property list", list, functions.H5Pclose)?;
                // SAFETY: the list is open, and the array has an entry for each dimension. 1 is
                // `H5D_FILL_TIME_NEVER`: new rows are not filled before they are written. Filling takes as long
                // as writing, and if the disk is full, ranks wait in it for the one that fails.
                let code =
                    unsafe {
                        (functions.H5Pset_chunk)(list.handle, width.dimensions(), chunk.as_ptr())
                            .min((functions.H5Pset_fill_time)(list.handle, 1))
                    };
                done(functions, "set the size of chunks", code)?;
                // SAFETY: all handles are open, and the name ends with a zero.
                let dataset = unsafe {
                    let (file, kind) = (self.file.handle, self.kind(kind));
                    let name = text.as_ptr();
                    (functions.H5Dcreate2)(file, name, kind, space.handle, DEFAULT, list.handle, DEFAULT)
                };
                Owned::new(functions, &format!("create {name}"), dataset, functions.H5Dclose).map(|_| ())
            })();
        self.agreed(made)
    }

    fn dataset(&self, name: &str) -> Result<Owned> {
        let functions = &self.hdf5.functions;
        let text = c_text(name)?;
        // SAFETY: the file is open, and the name ends with a zero.
        let found = unsafe { (functions.H5Dopen2)(self.file.handle, text.as_ptr(), DEFAULT) };
        Owned::new(functions, &format!("open {name}"), found, functions.H5Dclose)
    }

    fn space_of(&self, dataset: &Owned) -> Result<(Owned, u64, Width)> {
        let functions = &self.hdf5.functions;
        // SAFETY: the dataset is open.
        let space = unsafe { (functions.H5Dget_space)(dataset.handle) };
        let space = Owned::new(functions, "size a dataset", space, functions.H5Sclose)?;
        let mut sizes = [0; 2];
        // SAFETY: sizes are read only if the space has at most two dimensions, for which there is room.
        let dimensions = unsafe { (functions.H5Sget_simple_extent_ndims)(space.handle) };
        if !(1..=2).contains(&dimensions) {
            return Err(Error::file("a dataset has neither one nor two dimensions"));
        }
        // SAFETY: as above; the largest sizes are not asked for.
        let code =
            unsafe { (functions.H5Sget_simple_extent_dims)(space.handle, sizes.as_mut_ptr(), null_mut()) };
        done(functions, "size a dataset", code)?;
        let width = if dimensions == 1 { Width::List } else { Width::Table(sizes[1]) };
        Ok((space, sizes[0], width))
    }

    /// Number of rows of a dataset, and whether its numbers have this type and width.
    ///
    /// # Errors
    /// There is no such dataset.
    pub fn rows(&self, name: &str, kind: NumberType, width: Width) -> Result<(u64, bool)> {
        let functions = &self.hdf5.functions;
        let read = self.dataset(name).and_then(|dataset| {
            let (_, rows, found) = self.space_of(&dataset)?;
            // SAFETY: the dataset is open.
            let own = unsafe { (functions.H5Dget_type)(dataset.handle) };
            let own = Owned::new(functions, "find the type of a dataset", own, functions.H5Tclose)?;
            // SAFETY: both types are open.
            let equal = unsafe { (functions.H5Tequal)(own.handle, self.kind(kind)) };
            Ok((rows, equal > 0 && found == width))
        });
        self.agreed(read)
    }

    /// Changes the number of rows of a dataset.
    ///
    /// # Errors
    /// There is no such dataset, or the disk can not be written.
    pub fn set_rows(&self, name: &str, rows: u64) -> Result<()> {
        let functions = &self.hdf5.functions;
        let changed = self.dataset(name).and_then(|dataset| {
            let (_, _, width) = self.space_of(&dataset)?;
            let sizes = width.sizes(rows);
            // SAFETY: the array has an entry for each dimension of the dataset.
            let code = unsafe { (functions.H5Dset_extent)(dataset.handle, sizes.as_ptr()) };
            done(functions, &format!("size {name}"), code)
        });
        self.agreed(changed)
    }

    /// Selects rows of a dataset, and a space of the same size in memory.
    fn select(&self, dataset: &Owned, start: u64, numbers: u64) -> Result<(Owned, Owned)> {
        let functions = &self.hdf5.functions;
        let (space, rows, width) = self.space_of(dataset)?;
        let count = numbers / width.numbers().max(1);
        if count * width.numbers() != numbers || start.checked_add(count).is_none_or(|end| end > rows) {
            return Err(Error::internal("rows do not fit their dataset"));
        }
        let sizes = width.sizes(count);
        let starts = [start, 0];
        // SAFETY: the arrays have an entry for each dimension, and the selection is within the dataset.
        let memory = unsafe { (functions.H5Screate_simple)(width.dimensions(), sizes.as_ptr(), null()) };
        let memory = Owned::new(functions, "create a space", memory, functions.H5Sclose)?;
        // SAFETY: as above; 0 is `H5S_SELECT_SET`.
        let code = unsafe {
            if count == 0 {
                (functions.H5Sselect_none)(space.handle).min((functions.H5Sselect_none)(memory.handle))
            } else {
                let (starts, sizes) = (starts.as_ptr(), sizes.as_ptr());
                (functions.H5Sselect_hyperslab)(space.handle, 0, starts, null(), sizes, null())
            }
        };
        done(functions, "select rows", code)?;
        Ok((memory, space))
    }

    /// Writes this rank's rows from row `start` on. A rank without rows takes part. Collective.
    ///
    /// # Errors
    /// The rows are outside of the dataset, or the disk can not be written.
    pub fn write(&self, name: &str, start: u64, rows: Rows) -> Result<()> {
        let functions = &self.hdf5.functions;
        let ready = self.dataset(name).and_then(|dataset| {
            let (memory, space) = self.select(&dataset, start, rows.len() as u64)?;
            Ok((dataset, memory, space))
        });
        let (dataset, memory, space) = self.agreed(ready)?;
        // SAFETY: all handles are open, and memory holds as many numbers of this type as are selected.
        let code = unsafe {
            let kind = self.kind(rows.number_type());
            let (dataset, transfer) = (dataset.handle, self.transfer.handle);
            (functions.H5Dwrite)(dataset, kind, memory.handle, space.handle, transfer, rows.pointer())
        };
        self.agreed(done(functions, &format!("write {name}"), code))
    }

    /// Reads the numbers of rows of a dataset of integers, the same on all ranks. Collective.
    ///
    /// # Errors
    /// There is no such dataset, or it has fewer rows.
    pub fn integers(&self, name: &str, start: u64, count: usize) -> Result<Vec<i64>> {
        let mut values = vec![0; count];
        self.read(name, start, NumberType::Int64, count, values.as_mut_ptr().cast())?;
        Ok(values)
    }

    /// Reads the numbers of rows of a dataset, the same on all ranks. Collective.
    ///
    /// # Errors
    /// There is no such dataset, or it has fewer rows.
    pub fn floats(&self, name: &str, start: u64, count: usize) -> Result<Vec<f64>> {
        let mut values = vec![0.0; count];
        self.read(name, start, NumberType::Float64, count, values.as_mut_ptr().cast())?;
        Ok(values)
    }

    /// `into` has room for `count` numbers of `kind`.
    fn read(&self, name: &str, start: u64, kind: NumberType, count: usize, into: *mut c_void) -> Result<()> {
        let functions = &self.hdf5.functions;
        let ready = self.dataset(name).and_then(|dataset| {
            let (memory, space) = self.select(&dataset, start, count as u64)?;
            Ok((dataset, memory, space))
        });
        let (dataset, memory, space) = self.agreed(ready)?;
        // SAFETY: all handles are open, and the caller has room for the selected numbers.
        let code = unsafe {
            let (kind, transfer) = (self.kind(kind), self.transfer.handle);
            (functions.H5Dread)(dataset.handle, kind, memory.handle, space.handle, transfer, into)
        };
        self.agreed(done(functions, &format!("read {name}"), code))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PETSc without parallel HDF5 is refused with the missing function, and the message names the
    /// package.
    #[test]
    fn a_missing_library_is_named() {
        // Nothing is called before all functions are found.
        let any = innermost as *const () as *mut c_void;
        let serial = |name: &CStr| (name != c"H5Pset_fapl_mpio").then_some(any);
        let refusal = start(serial).err().unwrap_or_default();
        assert!(refusal.contains("H5Pset_fapl_mpio"), "{refusal}");
        assert!(start(|_: &CStr| None).is_err());
        assert!(CURE.contains("libhdf5-openmpi-dev"));
    }
}
