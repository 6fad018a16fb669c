/* Macros of PETSc as functions. */
#include <petscksp.h>

PetscErrorCode contact_log_begin(PetscLogEvent event);
PetscErrorCode contact_log_end(PetscLogEvent event);

/* Frees what PETSc allocated for its caller. */
PetscErrorCode contact_free(void *memory);
