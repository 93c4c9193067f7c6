// Layout: what the "tangent" codec knows of a groom before the first frame: coding order of strands, slices,
// neighbours and rest lengths. Both sides compute it from the rest shape. Private to common/strands/tangent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast::tangent {

/// Number of places in a block, which vector registers hold side by side.
inline constexpr uint32_t kBlockSize = 8;
inline constexpr uint32_t kNoStrand = UINT32_MAX;

/// Two places beside each place of a layout, in earlier blocks; `no_neighbour()` where there is none.
using Neighbours = std::array<std::vector<uint32_t>, 2>;  // (stride)

/// Strands in coding order. A place is a position in that order; slices begin at whole blocks, so some places
/// at a slice's end hold no strand. The last block of all, `no_neighbour()`, holds zeros in every array.
struct Layout {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t stride = 0;                            // places, the block of zeros included
  std::vector<uint32_t> strand_at;                // (stride) place -> strand, or kNoStrand
  std::vector<uint32_t> place_of;                 // (strand_count) strand -> place
  std::vector<float> presence;                    // (stride) 1, or 0 where there is no strand
  std::vector<uint32_t> slice_begin;              // (slice_count + 1) first place of each slice
  std::vector<uint32_t> strands_in;               // (slice_count) the first places of each slice hold strands
  Neighbours neighbour;                           // the nearest roots, of the same slice
  Neighbours alike;                               // the most alike at rest, of all slices
  std::vector<float> rest_length_m;               // (vertex_count x stride) of the segment before
  std::array<std::vector<float>, 3> rest_edge_m;  // (vertex_count x stride) from the vertex before; roots

  uint32_t slice_count() const { return static_cast<uint32_t>(slice_begin.size()) - 1; }
  uint32_t no_neighbour() const { return stride - kBlockSize; }
  size_t plane_size() const { return static_cast<size_t>(vertex_count) * stride; }
};

/// Computes the layout. `rest_in_head_m`: (vertex_count x strand_count), strand fastest, or empty; strands
/// then have no known lengths and no neighbours.
///
/// The first slice holds every 8th strand along a curve through the roots, the next those halfway between,
/// and so on. So the first n slices are an even thinning of the groom.
Layout make_layout(uint32_t strand_count, uint32_t vertex_count, std::span<const glm::vec3> rest_in_head_m);

}  // namespace strandcast::tangent
