// The one place where the core's functions leave why they failed, for strand_core_error(). One thread.
#pragma once

#include "common/base/result.h"

void remember_core_error(const strandcast::Error& error);
