// Common parts of the WebAssembly modules' functions for scripts: their visibility, and the storage of the
// last error for strand_core_error(). One thread.
#pragma once

#include "common/base/result.h"

#define STRAND_CORE_EXPORT extern "C" __attribute__((visibility("default"), used))

void remember_core_error(const strandcast::Error& error);
