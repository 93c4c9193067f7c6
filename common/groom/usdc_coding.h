// How the binary form of USD ("crate") packs bytes and integers, both ways: blocks of LZ4, and differences of
// 0, 1, 2 or 4 bytes. Unpacking takes untrusted input and allocates what the packed bytes explain. Any
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr std::string_view kUsdcMagic = "PXR-USDC";  // how a file begins
inline constexpr size_t kUsdcHeaderBytes = 88, kUsdcVersionAt = 8, kUsdcContentsAt = 16,
                        kUsdcSectionNameBytes = 16;
inline constexpr uint64_t kLeastUsdcPacked = 16;  // items of an array

/// Types of values that strands need, by their numbers in the file.
enum class UsdcType : uint8_t {
  Bool = 1,
  Int = 3,
  UInt = 4,
  Half = 7,
  Float = 8,
  Double = 9,
  String = 10,
  Token = 11,
  Matrix4d = 15,
  Quatd = 16,
  Quatf = 17,
  Quath = 18,
  Vec2d = 19,
  Vec2f = 20,
  Vec2h = 21,
  Vec3d = 23,
  Vec3f = 24,
  Vec3h = 25,
  TokenListOp = 32,
  PathListOp = 34,
  TokenVector = 41,
  Specifier = 42,
  Variability = 44,
  TimeSamples = 46,
  DoubleVector = 48,
  ValueBlock = 51
};

/// What a spec describes, by its number in the file.
enum class UsdcKind : int32_t { Attribute = 1, Prim = 6, Root = 7, Relationship = 8 };

/// A value, or where it lies.
struct UsdcValue {
  uint64_t bits = 0;

  static constexpr uint64_t kArray = uint64_t{1} << 63, kInlined = uint64_t{1} << 62,
                            kPacked = uint64_t{1} << 61, kPayload = (uint64_t{1} << 48) - 1;
  static UsdcValue of(UsdcType type, uint64_t payload, uint64_t flags = 0) {
    return {flags | static_cast<uint64_t>(type) << 48 | payload};
  }
  bool is(uint64_t flag) const { return (bits & flag) != 0; }
  UsdcType type() const { return static_cast<UsdcType>(bits >> 48 & 0xff); }
  uint64_t payload() const { return bits & kPayload; }
};

/// Packs bytes as one block of LZ4 behind a zero, as USD stores them.
std::string pack_usdc_bytes(std::span<const std::byte> bytes);

/// Unpacks what pack_usdc_bytes() or another writer of USD packed; BadInput if it is damaged or makes more
/// than `limit_bytes`.
Result<std::vector<std::byte>> unpack_usdc_bytes(std::span<const std::byte> packed, size_t limit_bytes);

/// Packs numbers by their differences; unsigned ones are cast.
std::string pack_usdc_ints(std::span<const int32_t> numbers);

/// Unpacks `count` numbers; BadInput if they are not all there.
Result<std::vector<int32_t>> unpack_usdc_ints(std::span<const std::byte> packed, size_t count);

}  // namespace strandcast
