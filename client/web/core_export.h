// What every module's functions for scripts have in common: how they are seen, and the one place where they
// leave why they failed, for strand_core_error(). One thread.
#pragma once

#include "common/base/result.h"

#define STRAND_CORE_EXPORT extern "C" __attribute__((visibility("default"), used))

void remember_core_error(const strandcast::Error& error);
