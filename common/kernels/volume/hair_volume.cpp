#include "common/kernels/volume/hair_volume.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/kernels/volume/volume_smooth.h"

namespace strandcast {
namespace {

// Work is cut by these and not by threads, so that results do not depend on them.
constexpr uint32_t kShares = 16;
constexpr uint32_t kSlabs = 16;
// Room for hair that flies: nodes of the grid over those of a cube around the groom at rest.
constexpr size_t kRoom = 2;
// A groom that is thinner than this has no volume.
constexpr float kMinExtentM = 1e-3f;

int32_t floor_cell(float cells) {
  return static_cast<int32_t>(std::floor(cells));
}

/// Hair that a sample's vertex stands for: half of the segments at either side of it, or, where segments are
/// sampled, the segment before it.
float sample_length_m(const VolumeStrands& strands, uint32_t vertex, uint32_t strand, uint32_t samples) {
  const glm::vec4* const at = strands.rest_in_head_m.data() + size_t{vertex} * strands.strand_count + strand;
  const float before = vertex == 0 ? 0.0f : at->w;
  if (samples > 1) return before;
  const bool is_last = vertex + 1 == strands.vertex_count;
  return 0.5f * (before + (is_last ? 0.0f : at[strands.strand_count].w));
}

Status check_options(const VolumeOptions& options) {
  if (options.resolution < kMinVolumeResolution || options.resolution > kMaxVolumeResolution)
    return make_error(ErrorCode::BadInput, "volume.resolution is {} (allowed: {} to {})", options.resolution,
                      kMinVolumeResolution, kMaxVolumeResolution);
  if (options.smoothing > kMaxVolumeSmoothing)
    return make_error(ErrorCode::BadInput, "volume.smoothing is {} (allowed: 0 to {})", options.smoothing,
                      kMaxVolumeSmoothing);
  return {};
}

}  // namespace

Result<HairVolume> HairVolume::make(const VolumeStrands& strands, const VolumeOptions& options) {
  RETURN_IF_ERROR(check_options(options));
  CHECK(strands.rest_in_head_m.size() == size_t{strands.strand_count} * strands.vertex_count);
  CHECK(strands.hairs.empty() || strands.hairs.size() == strands.strand_count);
  glm::vec3 low(strands.rest_in_head_m.front());
  glm::vec3 high = low;
  float longest_m = 0.0f;
  for (const glm::vec4& vertex : strands.rest_in_head_m) {
    low = glm::min(low, glm::vec3(vertex));
    high = glm::max(high, glm::vec3(vertex));
    longest_m = std::max(longest_m, vertex.w);
  }
  const glm::vec3 extent = high - low;
  const float longest_side_m = std::max({extent.x, extent.y, extent.z});
  if (!(longest_side_m > kMinExtentM))
    return make_error(ErrorCode::BadInput,
                      "volume: the groom's box is {:.3g} m wide: there is no hair to put in a volume",
                      longest_side_m);
  const float cell_m =
      options.cell_m > 0.0f ? options.cell_m : longest_side_m / static_cast<float>(options.resolution);
  const float cells_across =
      options.cell_m > 0.0f ? std::ceil(longest_side_m / cell_m) : static_cast<float>(options.resolution);
  if (cells_across > static_cast<float>(kMaxVolumeResolution))
    return make_error(ErrorCode::BadInput,
                      "volume: the hair is {:.3g} m wide, more than {} cells of {:.3g} m", longest_side_m,
                      kMaxVolumeResolution, cell_m);
  const glm::vec3 farthest = glm::max(glm::abs(low), glm::abs(high));
  if (std::max({farthest.x, farthest.y, farthest.z}) > kVolumeReachCells * cell_m)
    return make_error(ErrorCode::BadInput,
                      "volume: the groom lies farther from the head joint than {} cells of {:.3g} m",
                      kVolumeReachCells, cell_m);
  HairVolume volume;
  volume.options_ = options;
  volume.workers_ = options.workers == nullptr ? &shared_workers() : options.workers;
  volume.grid_.cell_m = cell_m;
  for (int axis = 0; axis < 3; ++axis) {
    volume.home_low_[axis] = floor_cell(low[axis] / cell_m);
    volume.home_high_[axis] = floor_cell(high[axis] / cell_m) + 1;
  }
  const size_t side = static_cast<size_t>(cells_across) + 2 * (2 * options.smoothing + 1) + 2;
  volume.most_nodes_ = kRoom * side * side * side;
  volume.samples_ = std::clamp(static_cast<uint32_t>(std::ceil(longest_m / cell_m)), 1u, kMaxSegmentSamples);

  const uint32_t blocks = block_count(strands.strand_count);
  volume.length_m_.assign(size_t{blocks} * strands.vertex_count * kBlockStrands, 0.0f);
  for (uint32_t strand = 0; strand < strands.strand_count; ++strand)
    for (uint32_t vertex = 0; vertex < strands.vertex_count; ++vertex) {
      const size_t row = size_t{strand / kBlockStrands} * strands.vertex_count + vertex;
      const float length_m = (strands.hairs.empty() ? 1.0f : strands.hairs[strand]) *
                             sample_length_m(strands, vertex, strand, volume.samples_);
      volume.length_m_[row * kBlockStrands + strand % kBlockStrands] = length_m;
      volume.total_length_m_ += static_cast<double>(length_m);
      if (length_m > 0.0f) volume.sample_count_ += volume.samples_;
    }
  volume.records_.resize(volume.sample_count_);
  volume.layer_begin_.resize(kMaxLayers + 1);
  volume.shares_.resize(std::min(kShares, blocks));
  const auto share_count = static_cast<uint32_t>(volume.shares_.size());
  for (uint32_t i = 0; i < share_count; ++i) {
    volume.shares_[i].begin = blocks * i / share_count;
    volume.shares_[i].end = blocks * (i + 1) / share_count;
    volume.shares_[i].places.resize(kMaxLayers);
  }
  volume.slabs_.resize(kSlabs);
  volume.scratch_.resize(std::min<size_t>(volume.workers_->size(), kSlabs));
  volume.other_.resize(volume.most_nodes_);
  return volume;
}

void HairVolume::update(const VolumeInput& input, std::span<glm::vec4> nodes) {
  CHECK(nodes.size() >= most_nodes_);
  VolumeScatter scatter;
  scatter.position_m = input.position_m;
  scatter.velocity_mps = input.velocity_mps;
  scatter.velocity_scale = input.velocity_scale;
  scatter.length_m = length_m_.data();
  scatter.samples = samples_;
  scatter.cells_from_world = (1.0f / grid_.cell_m) * input.head_from_world;
  scatter.head_velocity_mps = input.head_velocity_mps;
  scatter.ahead_s = input.ahead_s;
  const auto for_shares = [&](const auto& work) {
    workers_->at(options_.priority).for_ranges(shares_.size(), 1, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        VolumeScatter share = scatter;
        share.counts = share.places = shares_[i].places.data();
        share.bounds = &shares_[i].bounds;
        share.first = grid_.first;
        share.records = records_.data();
        work(VolumeScatterRange{&share, shares_[i].begin, shares_[i].end});
      }
    });
  };
  constexpr float kFar = kMaxLayers;
  for (Share& share : shares_) {
    std::fill(share.places.begin() + counted_.begin, share.places.begin() + counted_.end, 0);
    share.bounds = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  }
  for_shares([&](const VolumeScatterRange& range) { count_records(options_.set, range); });
  fit_grid();
  choose_places();
  for_shares([&](const VolumeScatterRange& range) { place_records(options_.set, range); });

  rows_.assign(grid_.row_count(), 0);
  other_rows_.assign(grid_.row_count(), 0);
  // As many passes as there are in all end in `nodes` where they begin in the right one of the two.
  const Field result{nodes.data(), rows_.data()};
  const Field other{other_.data(), other_rows_.data()};
  choose_slabs();
  sum_layers(result);
  add_last_layers(result);
  for (uint32_t i = 0; i < options_.smoothing; ++i) smooth(result, other, false);
  divide(result);
  for (uint32_t i = 0; i < options_.smoothing; ++i) smooth(result, other, true);
  // Whoever looks up where nothing is finds nothing.
  for_layers([&](uint32_t begin, uint32_t end) {
    for (size_t row = size_t{begin} * grid_.nodes.y; row < size_t{end} * grid_.nodes.y; ++row)
      if (rows_[row] == 0) std::fill_n(nodes.data() + row * grid_.nodes.x, grid_.nodes.x, glm::vec4(0.0f));
  });
}

/// The grid around what was counted, with a margin that smoothing fills and one for strands that move on
/// while the volume stays; cut down to the groom's own box, side by side, where it would be too large.
void HairVolume::fit_grid() {
  glm::vec3 low(static_cast<float>(kMaxLayers));
  glm::vec3 high = -low;
  for (const Share& share : shares_)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], share.bounds.low[static_cast<size_t>(axis)]);
      high[axis] = std::max(high[axis], share.bounds.high[static_cast<size_t>(axis)]);
    }
  const int32_t margin = 2 * static_cast<int32_t>(options_.smoothing) + 1;
  glm::ivec3 first(0);
  glm::ivec3 last(0);
  for (int axis = 0; axis < 3; ++axis) {
    const bool has_hair = low[axis] <= high[axis];
    first[axis] = (has_hair ? floor_cell(low[axis]) : home_low_[axis]) - margin;
    last[axis] = (has_hair ? floor_cell(high[axis]) + 1 : home_high_[axis]) + margin;
  }
  const auto size = [&] {
    const glm::i64vec3 nodes = glm::i64vec3(last - first) + glm::i64vec3(1);
    return static_cast<size_t>(nodes.x * nodes.y * nodes.z);
  };
  while (size() > most_nodes_) {
    // The side that sticks out farthest gives way first.
    int worst = 0;
    bool is_low = true;
    int32_t most = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t below = home_low_[axis] - margin - first[axis];
      const int32_t above = last[axis] - home_high_[axis] - margin;
      if (std::max(below, above) <= most) continue;
      most = std::max(below, above);
      worst = axis;
      is_low = below >= above;
    }
    CHECK(most > 0);  // the groom's own box fits
    (is_low ? first[worst] : last[worst]) += is_low ? 1 : -1;
  }
  grid_.first = first;
  grid_.nodes = glm::uvec3(last - first + 1);
}

/// Turns the counts of layers and shares into the places where their records begin: layer by layer, in the
/// order of strands. Only layers that hold hair are walked.
void HairVolume::choose_places() {
  constexpr float kMiddle = kMaxLayers / 2;
  float low = kMaxLayers;
  float high = -low;
  for (const Share& share : shares_) {
    low = std::min(low, share.bounds.low[2]);
    high = std::max(high, share.bounds.high[2]);
  }
  counted_ = {};
  if (low <= high) {
    counted_.begin = static_cast<uint32_t>(std::floor(low) + kMiddle);
    counted_.end = static_cast<uint32_t>(std::floor(high) + kMiddle) + 1;
  }
  uint32_t next = 0;
  for (uint32_t layer = counted_.begin; layer < counted_.end; ++layer) {
    layer_begin_[layer] = next;
    for (Share& share : shares_) next += std::exchange(share.places[layer], next);
  }
  // The grid reaches beyond the hair.
  const auto first = static_cast<uint32_t>(grid_.first.z + kMaxLayers / 2);
  const uint32_t end = first + grid_.nodes.z;
  for (uint32_t layer = first; layer < std::min(end, counted_.begin); ++layer) layer_begin_[layer] = 0;
  for (uint32_t layer = std::max(first, counted_.end); layer < end; ++layer) layer_begin_[layer] = next;
}

/// Layers of cells in runs of about as many records each.
void HairVolume::choose_slabs() {
  const uint32_t* const begin = layer_begin_.data() + grid_.first.z + kMaxLayers / 2;
  const uint32_t layers = grid_.nodes.z - 1;
  const uint64_t inside = begin[layers] - begin[0];
  uint32_t layer = 0;
  for (uint32_t i = 0; i < kSlabs; ++i) {
    Slab& slab = slabs_[i];
    slab.begin = layer;
    const uint64_t goal = inside * (i + 1) / kSlabs;
    while (layer < layers && (i + 1 == kSlabs || begin[layer] - begin[0] < goal)) ++layer;
    slab.end = layer;
    slab.outside = 0;
  }
}

void HairVolume::sum_layers(const Field& sums) {
  const uint32_t* const layer_begin = layer_begin_.data() + grid_.first.z + kMaxLayers / 2;
  const size_t layer_size = grid_.layer_size();
  for (Scratch& scratch : scratch_)
    if (scratch.layers.size() < 2 * layer_size * 4 || scratch.rows.size() < 2 * size_t{grid_.nodes.y}) {
      scratch.layers.resize(std::max(scratch.layers.size(), 2 * layer_size * 4));
      scratch.rows.resize(std::max(scratch.rows.size(), 2 * size_t{grid_.nodes.y}));
    }
  const auto terms = workers_->at(options_.priority, static_cast<uint32_t>(scratch_.size()));
  terms.for_ranges(slabs_.size(), 1, [&](size_t first, size_t last, uint32_t worker) {
    for (size_t i = first; i < last; ++i) {
      Slab& slab = slabs_[i];
      if (slab.begin == slab.end) continue;
      slab.last_sums.resize(std::max(slab.last_sums.size(), layer_size));
      slab.last_rows.resize(std::max<size_t>(slab.last_rows.size(), grid_.nodes.y));
      VolumeSlab work;
      work.records = records_.data();
      work.layer_begin = layer_begin;
      work.begin = slab.begin;
      work.end = slab.end;
      work.nodes = grid_.nodes;
      work.scratch = scratch_[worker].layers.data();
      work.scratch_rows = scratch_[worker].rows.data();
      work.sums = sums.values;
      work.rows = sums.rows;
      work.last_sums = slab.last_sums.data();
      work.last_rows = slab.last_rows.data();
      work.outside = &slab.outside;
      sum_slab(options_.set, work);
    }
  });
  const uint64_t placed = layer_begin[grid_.nodes.z - 1] - layer_begin[0];
  outside_count_ = sample_count_ - placed;
  for (const Slab& slab : slabs_) outside_count_ += slab.outside;
}

/// The layer of nodes between two slabs is what both have summed there.
void HairVolume::add_last_layers(const Field& sums) {
  for (const Slab& slab : slabs_) {
    if (slab.begin == slab.end) continue;
    for (uint32_t y = 0; y < grid_.nodes.y; ++y) {
      if (slab.last_rows[y] == 0) continue;
      const size_t row = size_t{slab.end} * grid_.nodes.y + y;
      const glm::vec4* const from = slab.last_sums.data() + size_t{y} * grid_.nodes.x;
      glm::vec4* const to = sums.values + row * grid_.nodes.x;
      if (sums.rows[row] == 0)
        std::copy_n(from, grid_.nodes.x, to);
      else
        for (uint32_t x = 0; x < grid_.nodes.x; ++x) to[x] += from[x];
      sums.rows[row] = 1;
    }
  }
}

template <class Work>
void HairVolume::for_layers(const Work& work) {
  const size_t grain = std::max<size_t>(kNodesOfRange / grid_.layer_size(), 1);
  workers_->at(options_.priority).for_ranges(grid_.nodes.z, grain, [&](size_t begin, size_t end) {
    work(static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
  });
}

void HairVolume::smooth(const Field& field, const Field& other, bool is_velocity) {
  VolumeSmooth work;
  work.nodes = grid_.nodes;
  work.parts = is_velocity ? VolumeParts::Velocity : VolumeParts::All;
  const auto pass = [&](auto kernel, const Field& from, const Field& to) {
    for_layers([&](uint32_t begin, uint32_t end) {
      VolumeSmooth layers = work;
      layers.from = from.values;
      layers.from_rows = from.rows;
      layers.to = to.values;
      layers.to_rows = to.rows;
      layers.begin = begin;
      layers.end = end;
      kernel(options_.set, layers);
    });
  };
  pass(smooth_in_layers, field, other);
  pass(smooth_across_layers, other, field);
}

void HairVolume::divide(const Field& field) {
  for_layers([&](uint32_t begin, uint32_t end) {
    const float cell_m = grid_.cell_m;
    divide_sums(options_.set,
                {grid_.nodes, 1.0f / (cell_m * cell_m * cell_m), field.values, field.rows, begin, end});
  });
}

uint64_t HairVolume::size_bytes() const {
  uint64_t bytes = length_m_.size() * sizeof(float) + records_.size() * sizeof(VolumeRecord) +
                   other_.size() * sizeof(glm::vec4) + layer_begin_.size() * sizeof(uint32_t) + rows_.size() +
                   other_rows_.size();
  for (const Share& share : shares_) bytes += share.places.size() * sizeof(uint32_t);
  for (const Slab& slab : slabs_) bytes += slab.last_sums.size() * sizeof(glm::vec4) + slab.last_rows.size();
  for (const Scratch& scratch : scratch_)
    bytes += scratch.layers.size() * sizeof(double) + scratch.rows.size();
  return bytes;
}

VolumeSample sample_volume(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                           const glm::dvec3& point_in_head_m) {
  VolumeSample sample;
  const glm::dvec3 at = point_in_head_m / static_cast<double>(grid.cell_m) - glm::dvec3(grid.first);
  const glm::dvec3 base = glm::floor(at);
  for (int axis = 0; axis < 3; ++axis)
    if (!(base[axis] >= 0.0 && base[axis] + 1.0 < static_cast<double>(grid.nodes[axis]))) return sample;
  sample.is_inside = true;
  const glm::uvec3 node(base);
  const glm::dvec3 share = at - base;
  for (uint32_t corner = 0; corner < 8; ++corner) {
    const glm::uvec3 far(corner & 1u, (corner >> 1) & 1u, corner >> 2);
    glm::dvec3 weight;
    glm::dvec3 slope;  // of the weight along each axis, per cell
    for (int axis = 0; axis < 3; ++axis) weight[axis] = far[axis] != 0 ? share[axis] : 1.0 - share[axis];
    for (int axis = 0; axis < 3; ++axis)
      slope[axis] = (far[axis] != 0 ? 1.0 : -1.0) * weight[(axis + 1) % 3] * weight[(axis + 2) % 3];
    const glm::dvec4 value(nodes[grid.index(node.x + far.x, node.y + far.y, node.z + far.z)]);
    sample.velocity_mps += weight.x * weight.y * weight.z * glm::dvec3(value);
    sample.density_mpm3 += weight.x * weight.y * weight.z * value.w;
    sample.gradient_mpm4 += slope * (value.w / static_cast<double>(grid.cell_m));
  }
  return sample;
}

}  // namespace strandcast
