// The fuzz entries by name, fuzz_NAME, for plain tests.
#pragma once

#include <cstddef>
#include <cstdint>

#define FUZZ_TARGET(name) extern "C" int fuzz_##name(const uint8_t* data, size_t size);
#include "fuzz_targets.inc"
#undef FUZZ_TARGET
