//! Families of laws: one line a law makes the enum that a case is read into, its table, and the way to the law's interface.

use std::fmt;

/// One law of a family.
pub struct LawEntry<F> {
    /// Name in the case file.
    pub name: &'static str,
    /// The schema of its parameters, whose description is the documentation of its struct.
    pub schema: fn() -> schemars::Schema,
    /// Laws of this kind on which every test of the family runs.
    pub samples: fn() -> Vec<F>,
}

impl<F> fmt::Debug for LawEntry<F> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl<F> LawEntry<F> {
    /// One line for `contact-petsc list`: the first paragraph of the documentation of the law's struct.
    pub fn about(&self) -> String {
        let schema = (self.schema)();
        let text = schema.get("description").and_then(|text| text.as_str()).unwrap_or_default();
        let first = text.split("\n\n").next().unwrap_or_default().replace('\n', " ");
        first.trim_end_matches('.').replace("\\[", "[").replace("\\]", "]")
    }
}

/// Makes the enum of a family of laws and its table.
///
/// A law is a file with a struct and one line: its name in cases, its file, its struct. The struct carries what is read (serde and the
/// schema), its checks and its physics, and `samples()` for the tests.
#[macro_export]
macro_rules! family {
    (
        $(#[$about:meta])*
        $family:ident ($noun:literal, schema $title:literal, table $table:ident):
        $($name:literal: $file:ident::$law:ident),+ $(,)?
    ) => {
        $(mod $file;)+
        $(pub use $file::$law;)+

        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(remote = "Self", deny_unknown_fields)]
        #[schemars(rename = $title)]
        #[expect(missing_docs, reason = "each law documents itself")]
        pub enum $family {
            $(
                #[serde(rename = $name)]
                $law($law),
            )+
        }
        $crate::reader::tagged::tagged!($family, $noun);

        /// Every law of the family: feeds `list`, the hints in errors and the tests.
        pub const $table: &[$crate::reader::laws::LawEntry<$family>] = &[$(
            $crate::reader::laws::LawEntry {
                name: $name,
                schema: || schemars::schema_for!($law),
                samples: || $law::samples().into_iter().map($family::$law).collect(),
            },
        )+];

        $(impl From<$law> for $family {
            fn from(law: $law) -> Self {
                Self::$law(law)
            }
        })+
    };
}
pub use crate::family;

/// Makes the enum of a family of laws, its table (see [`family`]), and `law()`, which gives the interface of whichever law it is.
#[macro_export]
macro_rules! laws {
    (
        $(#[$about:meta])*
        $family:ident ($noun:literal, schema $title:literal, table $table:ident) implements $interface:ident:
        $($name:literal: $file:ident::$law:ident),+ $(,)?
    ) => {
        $crate::reader::laws::family! {
            $(#[$about])*
            $family ($noun, schema $title, table $table):
            $($name: $file::$law),+
        }

        impl Copy for $family {}

        impl $family {
            /// The interface of the law.
            pub fn law(&self) -> &dyn $interface {
                match self {
                    $(Self::$law(law) => law,)+
                }
            }
        }
    };
}
pub use crate::laws;
