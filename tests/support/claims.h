// Numbers that documents promise, in one place: the tests that measure them take their limits from here, and
// tests/unit/claims_test.cpp holds the documents to the same numbers.
#pragma once

#include <cstdint>

namespace strandcast::claims {

// ---- direct_rod, with one linear solve per step ----

inline constexpr uint32_t kRodVertices = 32;

/// Distance of a cantilever's tip from the exact one, over the length, up to Gamma = g L^3 / b;
/// a hair of 0.3 m and the default constants has 184.
inline constexpr double kCantileverTip = 0.0012;
inline constexpr double kCantileverGamma = 200.0;
inline constexpr double kHeavyCantileverTip = 0.0021;
inline constexpr double kHeavyCantileverGamma = 1000.0;
/// First swing of a cantilever that is let go, relative, at kFirstSwingHz.
inline constexpr double kFirstSwing = 0.002;
inline constexpr double kFirstSwingHz = 240.0;
/// Distance of the tip under a load at the end, over the length.
inline constexpr double kEndLoadTip = 0.0005;
/// Extension of a curl under its weight against that of a helical spring, relative.
inline constexpr double kCurlSpring = 0.01;
/// The load at which an upright strand buckles lies within so much of Greenhill's to either side.
inline constexpr double kBuckling = 0.01;
/// Largest relative change of a segment's length in a head shake of so many g.
inline constexpr double kShakeStretch = 1e-4;
inline constexpr double kShakeG = 10.0;

/// `articulated` and the rod, both converged, on a moving head: RMS distance over the length.
inline constexpr double kModelsApart = 0.001;

/// Most that a root leans from its groomed direction, whatever model runs and however fast the head is: what
/// scenes have unless they say otherwise.
inline constexpr double kFollicleLimitDeg = 20.0;

// ---- iterated constraints in the violent motions of the stability report: largest stretch ----

inline constexpr double kPbdViolentStretch = 6.6;
inline constexpr double kXpbdViolentStretch = 3.5;

/// Asset of the built-in hair, 2,000 x 16 with its head, in kB.
inline constexpr uint32_t kAssetKb = 100;

// ---- the strand codec `tangent` at 0.1 mm on the built-in scene's hair, dftl with 0.3 of its weight
// carried, half a second each ----

inline constexpr uint32_t kStreamStrands = 500;
inline constexpr uint32_t kStreamVertices = 16;
/// Bits per vertex of the built-in head motions.
inline constexpr double kIdleBits = 1.4;
inline constexpr double kActiveBits = 2.3;
inline constexpr double kViolentBits = 6.4;
/// Of `delta` beside it in these.
inline constexpr double kLeastDeltaRatio = 1.7;
inline constexpr double kMostDeltaRatio = 4.0;
/// Strands that were left out beside the truth while turning, a quarter of these sent: mm.
inline constexpr uint32_t kFilledStrands = 1'000;
inline constexpr double kFilledMedianMm = 1.7;
inline constexpr double kFilledMostMm = 6.3;  // of 95 % of the vertices
/// Of the median half second of a walk.
inline constexpr const char* kStreamClip = "cmu_131_03.bvh";
inline constexpr double kClipBits = 4.7;
inline constexpr double kTimesFewerThanTemporal = 2.0;
inline constexpr double kTimesFewerThanPlain = 5.7;

// ---- `step` at 0.1 mm when all of the wind is known, half a second each, dftl ----

inline constexpr uint32_t kStepStrands = 2'000;
/// Bits per vertex of the built-in head motions with hair of full quality: idle, turning, violent.
inline constexpr double kFullStepBits[] = {0.23, 0.19, 0.31};
inline constexpr double kFullTangentBits[] = {1.2, 2.1, 6.0};
/// Bits per vertex of the built-in head motions.
inline constexpr double kStepIdleBits = 0.18;
inline constexpr double kStepActiveBits = 0.17;
inline constexpr double kStepViolentBits = 0.36;
/// Of the median half second of the walk kStreamClip.
inline constexpr double kStepClipBits = 0.29;
inline constexpr double kStepTimesFewerThanTemporal = 32.0;

}  // namespace strandcast::claims
