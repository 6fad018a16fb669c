#include "shim.h"

PetscErrorCode contact_log_begin(PetscLogEvent event)
{
  return PetscLogEventBegin(event, NULL, NULL, NULL, NULL);
}

PetscErrorCode contact_log_end(PetscLogEvent event)
{
  return PetscLogEventEnd(event, NULL, NULL, NULL, NULL);
}

PetscErrorCode contact_allocate(size_t bytes, void **memory)
{
  return PetscMalloc(bytes, memory);
}

PetscErrorCode contact_free(void *memory)
{
  return PetscFree(memory);
}
