#include "server/sim/executor/gl_volume.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "common/base/check.h"
#include "server/sim/executor/gl_plane.h"
#include "shaders/shared/hair_volume.h"

namespace strandcast {
namespace {

static_assert(1u << shader::kVolumePartBits == kMaxSegmentSamples);
static_assert(shader::kVolumeReach == static_cast<uint32_t>(kVolumeReachCells));

// Groups that look for bounds, and turns of a loop that one of their invocations may take.
constexpr uint32_t kBoundsGroups = 32;
constexpr uint64_t kMostTurns = 32'768;
constexpr size_t kCorners = 8;
// A row of nodes has a cell of hair and a margin at either side, so that it is no shorter.
constexpr size_t kLeastRow = 4;

struct ScatterRow {
  std::string_view name;
  bool sorts;
};
constexpr ScatterRow kScatters[] = {{"sort", true}, {"atomics", false}};

/// A buffer that kernels store to, and fetch from through a buffer texture.
struct FetchedBuffer {
  gl::Buffer buffer;
  gl::Texture view;

  FetchedBuffer() = default;
  FetchedBuffer(const std::string& label, uint32_t texel_format, size_t size_bytes)
      : buffer(label, size_bytes), view(gl::Texture::view_of(label, texel_format, buffer)) {}
};

uint32_t groups_of(uint64_t invocations) {
  return static_cast<uint32_t>((invocations + shader::kVolumeLocalSize - 1) / shader::kVolumeLocalSize);
}

class GlVolume final : public DeviceVolume {
 public:
  GlVolume(const DeviceVolumeDesc& desc, bool sorts) : desc_(desc), sorts_(sorts) {}

  Status check(const gl::DeviceLimits& limits) const {
    const size_t nodes = desc_.volume->most_nodes();
    const size_t vectors = std::max({nodes + shader::kVolumeHeader, samples(), kCorners * (cells() + 1)});
    const char* const user = "volume.scatter";
    if (size_t{desc_.strand_count} * desc_.vertex_count > ~0u >> shader::kVolumePartBits)
      return make_error(ErrorCode::LimitExceeded, "volume.scatter: {} strands x {} vertices are too many",
                        desc_.strand_count, desc_.vertex_count);
    RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::BufferTexels, vectors, user));
    RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::GroupCount,
                                           std::max(groups_of(desc_.strand_count), rows()), user));
    return gl::check_device_limit(limits, gl::DeviceLimit::StorageBlockBytes, vectors * sizeof(glm::vec4),
                                  user);
  }
  Status compile(const gl::ShaderLibrary& shaders);
  void allocate();
  void forget_host() { desc_.volume = nullptr; }

  void update(const StepBlock& step, const StrandPlane& position, const StrandPlane& motion,
              LookupTable& table) override;
  DeviceVolumeFacts read_facts() const override;
  void read_nodes(const LookupTable& table, std::vector<glm::vec4>& nodes) const override;
  uint64_t size_bytes() const override;

 private:
  uint32_t rows() const {
    const uint32_t split = desc_.volume->segment_samples();
    return split == 1 ? desc_.vertex_count : (desc_.vertex_count - 1) * split;
  }
  size_t samples() const { return size_t{rows()} * desc_.strand_count; }
  /// In use, at most.
  size_t cells() const { return sorts_ ? std::min(samples(), desc_.volume->most_nodes()) : 0; }

  /// What was stored can be fetched, and is what the next dispatch goes by.
  static void wait() {
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT | GL_UNIFORM_BARRIER_BIT |
                    GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  }
  static void run(const gl::Program& program, uint32_t groups_x, uint32_t groups_y = 1) {
    program.use();
    glDispatchCompute(groups_x, groups_y, 1);
    wait();
  }
  void run_counted(const gl::Program& program, uint32_t groups_fact) const {
    program.use();
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, facts_.name());
    glDispatchComputeIndirect(static_cast<GLintptr>(groups_fact * sizeof(uint32_t)));
    wait();
  }
  void sum_sorted() const;
  void sum_by_atomics() const;
  void smooth(const gl::Buffer& nodes, const GlTable& table) const;

  DeviceVolumeDesc desc_;
  bool sorts_;
  float cell_m_ = 0.0f;
  size_t most_nodes_ = 0;
  uint32_t row_count_ = 0;     // of samples
  uint64_t sample_count_ = 0;  // that are hair
  uint32_t bounds_groups_ = 0;

  gl::Program clear_, bounds_, fit_, rank_, rows_, segments_, groups_, place_, cells_, crowds_, atomics_,
      gather_;
  gl::Program smooth_xy_, smooth_z_, divide_z_, smooth_velocity_xy_, smooth_velocity_z_;
  FetchedBuffer lengths_;  // (vertex_count x strand_count) float
  FetchedBuffer places_;   // (vertex_count x strand_count) vec4
  FetchedBuffer motions_;  // (vertex_count x strand_count) vec4
  gl::Buffer step_{"step", sizeof(StepBlock)};
  gl::Buffer facts_;       // kFactCount words
  gl::Buffer counts_;      // (most_nodes) uint, zero between updates
  FetchedBuffer ranks_;    // (rows x strand_count) uvec2
  FetchedBuffer records_;  // (samples) uint; by atomics: (most_nodes) ivec4, zero between updates
  FetchedBuffer cell_;     // (most_nodes) uvec2
  FetchedBuffer lists_;    // (cells, then crowds) uvec4
  FetchedBuffer sums_;     // (cells + 1) x 8 vec4
  FetchedBuffer masks_;    // (most_nodes / kLeastRow) uvec2
  FetchedBuffer segment_;  // uvec4
  FetchedBuffer other_;    // as a table
};

Status GlVolume::compile(const gl::ShaderLibrary& shaders) {
  const HairVolume& volume = *desc_.volume;
  cell_m_ = volume.cell_m();
  most_nodes_ = volume.most_nodes();
  row_count_ = rows();
  sample_count_ = volume.sample_count();
  const uint64_t strands_each = kMostTurns / desc_.vertex_count;
  bounds_groups_ = std::min(groups_of(desc_.strand_count),
                            std::max(kBoundsGroups, groups_of(desc_.strand_count / strands_each + 1)));
  const uint32_t reach = 2 * desc_.smoothing;
  const auto crowds_begin = static_cast<uint32_t>(cells());
  const int is_split = volume.segment_samples() > 1 ? 1 : 0;
  constexpr const char* kBounds = "bounds";
  const auto make = [&](gl::Program& program, const char* name, const gl::Variant& variant) -> Status {
    ASSIGN_OR_RETURN(program, gl::Program::make(shaders, {std::string("volume/") + name + ".comp"}, variant));
    return {};
  };
  const auto make_of_samples = [&](gl::Program& program, const char* name,
                                   const gl::Variant& variant = {}) -> Status {
    gl::Variant all = variant;
    all["HAS_SPLIT"] = is_split;
    RETURN_IF_ERROR(make(program, name, all));
    program.set("u_sample_count", volume.segment_samples());
    if (name != kBounds) program.set("u_strand_count", desc_.strand_count);
    return {};
  };
  const auto make_of_nodes = [&](gl::Program& program, const char* name,
                                 const gl::Variant& variant) -> Status {
    RETURN_IF_ERROR(make(program, name, variant));
    program.set("u_per_cell_m3", 1.0f / (cell_m_ * cell_m_ * cell_m_));
    return {};
  };
  const std::span<const float> lengths_m = volume.sample_lengths_m();
  const float most_length_m =
      *std::max_element(lengths_m.begin(), lengths_m.end()) / static_cast<float>(volume.segment_samples());
  RETURN_IF_ERROR(make_of_nodes(clear_, "clear", {}));
  RETURN_IF_ERROR(make_of_samples(bounds_, kBounds, {{"HAS_WAY", desc_.has_way ? 1 : 0}}));
  bounds_.set("u_per_cell", 1.0f / cell_m_);
  bounds_.set("u_ahead", desc_.is_ahead ? 1.0f : 0.0f);
  RETURN_IF_ERROR(make(fit_, "fit", {}));
  fit_.set("u_per_cell", 1.0f / cell_m_);
  fit_.set("u_home_low", glm::vec3(volume.home_low()));
  fit_.set("u_home_high", glm::vec3(volume.home_high()));
  fit_.set("u_margin", reach + 1);
  fit_.set("u_most_nodes", static_cast<uint32_t>(most_nodes_));
  RETURN_IF_ERROR(make_of_samples(rank_, "rank", {{"KEEPS_RANKS", sorts_ ? 1 : 0}}));
  RETURN_IF_ERROR(make(rows_, "rows", {{"SORTS", sorts_ ? 1 : 0}}));
  rows_.set("u_reach", reach);
  rows_.set("u_crowds_begin", crowds_begin);
  RETURN_IF_ERROR(make(segments_, "segments", {}));
  segments_.set("u_reach", reach);
  RETURN_IF_ERROR(make(groups_, "groups", {}));
  RETURN_IF_ERROR(make_of_nodes(gather_, "gather",
                                {{"FROM_CELLS", sorts_ ? 1 : 0}, {"DIVIDES", desc_.smoothing == 0 ? 1 : 0}}));
  if (sorts_) {
    RETURN_IF_ERROR(make_of_samples(place_, "place"));
    RETURN_IF_ERROR(make_of_samples(cells_, "cells", {{"HAS_CROWD", 0}}));
    RETURN_IF_ERROR(make_of_samples(crowds_, "cells", {{"HAS_CROWD", 1}}));
    for (const gl::Program* program : {&cells_, &crowds_}) {
      program->set("u_most_length", most_length_m);
      program->set("u_crowds_begin", crowds_begin);
    }
  } else {
    RETURN_IF_ERROR(make_of_samples(atomics_, "atomics"));
    atomics_.set("u_most_length", most_length_m);
    gather_.set("u_most_length", most_length_m);
  }
  if (desc_.smoothing == 0) return {};
  RETURN_IF_ERROR(make_of_nodes(smooth_xy_, "smooth", {}));
  RETURN_IF_ERROR(make_of_nodes(smooth_z_, "smooth", {{"ALONG_Z", 1}}));
  RETURN_IF_ERROR(make_of_nodes(divide_z_, "smooth", {{"ALONG_Z", 1}, {"DIVIDES", 1}}));
  RETURN_IF_ERROR(make_of_nodes(smooth_velocity_xy_, "smooth", {{"OF_VELOCITY", 1}}));
  return make_of_nodes(smooth_velocity_z_, "smooth", {{"ALONG_Z", 1}, {"OF_VELOCITY", 1}});
}

void GlVolume::allocate() {
  const HairVolume& volume = *desc_.volume;
  const uint32_t strands = desc_.strand_count;
  std::vector<float> lengths(size_t{strands} * desc_.vertex_count);
  const float share = 1.0f / static_cast<float>(volume.segment_samples());
  for (uint32_t vertex = 0; vertex < desc_.vertex_count; ++vertex)
    for (uint32_t strand = 0; strand < strands; ++strand) {
      const size_t row = size_t{strand / kBlockStrands} * desc_.vertex_count + vertex;
      lengths[size_t{vertex} * strands + strand] =
          share * volume.sample_lengths_m()[row * kBlockStrands + strand % kBlockStrands];
    }
  lengths_ = {"volume lengths", GL_R32F, lengths.size() * sizeof(float)};
  lengths_.buffer.write(lengths);
  places_ = {"volume places", GL_RGBA32F, lengths.size() * sizeof(glm::vec4)};
  motions_ = {"volume motions", GL_RGBA32F, lengths.size() * sizeof(glm::vec4)};
  std::vector<uint32_t> facts(shader::kFactCount, 0);
  std::fill_n(facts.begin() + shader::kFactLow, 3, ~0u);
  facts_ = gl::Buffer::of("volume facts", facts);
  counts_ = gl::Buffer("volume counts", most_nodes_ * sizeof(uint32_t));
  masks_ = {"volume masks", GL_RG32UI, (most_nodes_ / kLeastRow + 1) * sizeof(glm::uvec2)};
  segment_ = {"volume segments", GL_RGBA32UI,
              (most_nodes_ / shader::kVolumeSegment + most_nodes_ / kLeastRow + 1) * sizeof(glm::uvec4)};
  other_ = {"volume smoothing", GL_RGBA32F, (most_nodes_ + shader::kVolumeHeader) * sizeof(glm::vec4)};
  if (sorts_) {
    ranks_ = {"volume ranks", GL_RG32UI, samples() * sizeof(glm::uvec2)};
    records_ = {"volume records", GL_R32UI, samples() * sizeof(uint32_t)};
    cell_ = {"volume cells", GL_RG32UI, most_nodes_ * sizeof(glm::uvec2)};
    lists_ = {"volume lists", GL_RGBA32UI,
              (cells() + samples() / shader::kVolumeCrowd + 1) * sizeof(glm::uvec4)};
    sums_ = {"volume sums", GL_RGBA32F, (cells() + 1) * kCorners * sizeof(glm::vec4)};
  } else {
    records_ = {"volume integers", GL_RGBA32I, most_nodes_ * sizeof(glm::ivec4)};
  }
}

void GlVolume::update(const StepBlock& step, const StrandPlane& position, const StrandPlane& motion,
                      LookupTable& table) {
  static_cast<const GlPlane&>(position).bind({shader::kUnitPosition, {}});
  static_cast<const GlPlane&>(motion).bind(
      {desc_.has_way ? shader::kUnitDisplacement : shader::kUnitVelocity, {}});
  const auto& nodes = static_cast<const GlTable&>(table);
  CHECK(nodes.buffer().size_bytes() >= (most_nodes_ + shader::kVolumeHeader) * sizeof(glm::vec4));
  step_.write(0, std::as_bytes(std::span(&step, 1)));
  step_.bind_uniform(shader::kBindingStep);
  facts_.bind_uniform(shader::kBindingVolumeFactsRead);
  facts_.bind_storage(shader::kBindingVolumeFacts);
  lengths_.view.bind(shader::kUnitVolumeLength);
  segment_.view.bind(shader::kUnitVolumeSegment);

  // What the last one left, by the list that it left.
  nodes.buffer().bind_storage(shader::kBindingVolumeNodes);
  other_.buffer.bind_storage(shader::kBindingVolumeRecords);
  run_counted(clear_, shader::kFactSegmentGroups);

  places_.buffer.bind_storage(shader::kBindingVolumePlaces);
  motions_.buffer.bind_storage(shader::kBindingVolumeMotions);
  run(bounds_, bounds_groups_);
  places_.view.bind(shader::kUnitVolumePlace);
  motions_.view.bind(shader::kUnitVolumeMotion);
  run(fit_, 1);
  counts_.bind_storage(shader::kBindingVolumeCounts);
  if (sorts_) ranks_.buffer.bind_storage(shader::kBindingVolumeRanks);
  run(rank_, groups_of(desc_.strand_count), row_count_);
  masks_.buffer.bind_storage(shader::kBindingVolumeMasks);
  if (sorts_) {
    cell_.buffer.bind_storage(shader::kBindingVolumeCells);
    lists_.buffer.bind_storage(shader::kBindingVolumeLists);
  }
  run_counted(rows_, shader::kFactRowGroups);
  masks_.view.bind(shader::kUnitVolumeMask);
  segment_.buffer.bind_storage(shader::kBindingVolumeLists);
  run_counted(segments_, shader::kFactRowGroups);
  run(groups_, 1);
  records_.buffer.bind_storage(shader::kBindingVolumeRecords);
  if (sorts_)
    sum_sorted();
  else
    sum_by_atomics();
  nodes.buffer().bind_storage(shader::kBindingVolumeNodes);
  run_counted(gather_, shader::kFactSegmentGroups);
  smooth(nodes.buffer(), nodes);
}

void GlVolume::sum_sorted() const {
  ranks_.view.bind(shader::kUnitVolumeRank);
  cell_.view.bind(shader::kUnitVolumeCell);
  run(place_, groups_of(desc_.strand_count), row_count_);
  records_.view.bind(shader::kUnitVolumeRecord);
  lists_.view.bind(shader::kUnitVolumeList);
  sums_.buffer.bind_storage(shader::kBindingVolumeNodes);
  run_counted(cells_, shader::kFactCellGroups);
  run_counted(crowds_, shader::kFactCrowdGroups);
  sums_.view.bind(shader::kUnitVolumeSum);
}

void GlVolume::sum_by_atomics() const {
  records_.buffer.bind_storage(shader::kBindingVolumeNodes);
  run(atomics_, groups_of(desc_.strand_count), row_count_);
}

/// As on the host: sums, which are divided at last, then the quotient.
void GlVolume::smooth(const gl::Buffer& nodes, const GlTable& table) const {
  const auto there_and_back = [&](const gl::Program& there, const gl::Program& back) {
    table.bind(shader::kUnitVolumeNode);
    other_.buffer.bind_storage(shader::kBindingVolumeNodes);
    run_counted(there, shader::kFactSegmentGroups);
    other_.view.bind(shader::kUnitVolumeNode);
    nodes.bind_storage(shader::kBindingVolumeNodes);
    run_counted(back, shader::kFactSegmentGroups);
  };
  for (uint32_t i = 1; i <= desc_.smoothing; ++i)
    there_and_back(smooth_xy_, i == desc_.smoothing ? divide_z_ : smooth_z_);
  for (uint32_t i = 0; i < desc_.smoothing; ++i) there_and_back(smooth_velocity_xy_, smooth_velocity_z_);
}

DeviceVolumeFacts GlVolume::read_facts() const {
  const std::vector<uint32_t> words = facts_.read_all<uint32_t>();
  DeviceVolumeFacts facts;
  facts.grid.cell_m = cell_m_;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    facts.grid.first[static_cast<int>(axis)] = static_cast<int32_t>(words[shader::kFactFirst + axis]) -
                                               static_cast<int32_t>(shader::kVolumeCellBias);
    facts.grid.nodes[static_cast<int>(axis)] = words[shader::kFactNodes + axis];
  }
  facts.outside_count = sample_count_ - words[shader::kFactPlaced];
  return facts;
}

void GlVolume::read_nodes(const LookupTable& table, std::vector<glm::vec4>& nodes) const {
  nodes.resize(read_facts().grid.size());
  static_cast<const GlTable&>(table).buffer().read(shader::kVolumeHeader * sizeof(glm::vec4),
                                                   std::as_writable_bytes(std::span(nodes)));
}

uint64_t GlVolume::size_bytes() const {
  uint64_t bytes = facts_.size_bytes() + counts_.size_bytes() + step_.size_bytes();
  for (const FetchedBuffer* fetched : {&lengths_, &places_, &motions_, &ranks_, &records_, &cell_, &lists_,
                                       &sums_, &masks_, &segment_, &other_})
    bytes += fetched->buffer.size_bytes();
  return bytes;
}

}  // namespace

Result<std::unique_ptr<DeviceVolume>> make_gl_volume(const gl::ShaderLibrary& shaders,
                                                     const gl::DeviceLimits& limits,
                                                     const DeviceVolumeDesc& desc) {
  const auto* const row =
      std::find_if(std::begin(kScatters), std::end(kScatters),
                   [&](const ScatterRow& scatter) { return scatter.name == desc.scatter; });
  if (row == std::end(kScatters))
    return make_error(ErrorCode::Unsupported,
                      "volume.scatter: {} is not known on OpenGL (known: sort, atomics)", desc.scatter);
  auto volume = std::make_unique<GlVolume>(desc, row->sorts);
  RETURN_IF_ERROR(volume->check(limits));
  RETURN_IF_ERROR(volume->compile(shaders));
  volume->allocate();
  volume->forget_host();
  return std::unique_ptr<DeviceVolume>(std::move(volume));
}

}  // namespace strandcast
