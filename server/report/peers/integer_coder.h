// IntegerCoder: interface to general libraries for lossless coding of integers; one .cpp file per library.
// lattice_peer.h makes the integers from positions and predicts them in time. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Kind of the integers: positions change slowly along a strand; residuals of a prediction are small and
/// nearly independent.
enum class IntegerKind { Positions, Residuals };

/// Integers of (3 x vertex_count x strand_count), axis-major, then vertex, strand fastest; neighbours in
/// space are neighbours in the array.
struct IntegerPlanes {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::vector<int32_t> value;

  /// Makes planes filled with zeros.
  static IntegerPlanes make(uint32_t strand_count, uint32_t vertex_count) {
    return {strand_count, vertex_count, std::vector<int32_t>(size_t{3} * strand_count * vertex_count, 0)};
  }
  size_t plane_size() const { return static_cast<size_t>(strand_count) * vertex_count; }
};

class IntegerCoder {
 public:
  virtual ~IntegerCoder() = default;
  virtual Result<std::vector<std::byte>> encode(const IntegerPlanes& planes, IntegerKind kind) = 0;
  /// Decodes planes of the sizes that were encoded.
  virtual Result<IntegerPlanes> decode(std::span<const std::byte> bytes, uint32_t strand_count,
                                       uint32_t vertex_count) = 0;
};

/// Makes a simple coder: 16 bits per integer, then zstd level 3. LimitExceeded beyond 16 bits.
std::unique_ptr<IntegerCoder> make_zstd_coder();
/// Makes a coder with meshoptimizer's vertex codec, then zstd level 3, as its author advises.
std::unique_ptr<IntegerCoder> make_meshopt_coder();
/// Makes a coder with Draco's sequential point cloud of integers.
std::unique_ptr<IntegerCoder> make_draco_coder();

}  // namespace strandcast
