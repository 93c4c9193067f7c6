#pragma once
// How many of one unit make another, for code that converts between units. The names read as the quotient
// that they are: metres times kMmPerM are millimetres. Times kept as whole nanoseconds or microseconds take
// the integers below.
#include <cstdint>

namespace strandcast {

inline constexpr double kNsPerS = 1e9;
inline constexpr double kNsPerMs = 1e6;
inline constexpr double kUsPerS = 1e6;
inline constexpr double kUsPerMs = 1e3;
inline constexpr double kMsPerS = 1e3;
inline constexpr double kMsPerNs = 1e-6;
inline constexpr double kSPerMs = 1e-3;
inline constexpr double kSPerUs = 1e-6;
inline constexpr double kSPerNs = 1e-9;

inline constexpr int64_t kSInNs = 1'000'000'000;
inline constexpr int64_t kMsInNs = 1'000'000;
inline constexpr int64_t kUsInNs = 1'000;
inline constexpr int64_t kSInUs = 1'000'000;

inline constexpr double kMmPerM = 1e3;
inline constexpr double kMPerMm = 1e-3;
inline constexpr double kCmPerM = 100.0;

inline constexpr double kBitsPerByte = 8.0;
inline constexpr double kMbitPerByte = 8e-6;

}  // namespace strandcast
