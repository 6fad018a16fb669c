/* Macros of PETSc as functions. */
#include <petscksp.h>

PetscErrorCode contact_log_begin(PetscLogEvent event);
PetscErrorCode contact_log_end(PetscLogEvent event);

/* Allocates memory that an object of PETSc will free. */
PetscErrorCode contact_allocate(size_t bytes, void **memory);

/* Frees what PETSc allocated for its caller. */
PetscErrorCode contact_free(void *memory);
