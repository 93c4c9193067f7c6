#include "server/report/volume_study.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/quantile.h"
#include "common/gl/egl_context.h"
#include "common/kernels/volume/hair_volume.h"
#include "server/report/process_time.h"
#include "server/sim/executor/gl_executor.h"
#include "server/sim/executor/gl_scatter_study.h"
#include "server/sim/volume/reference_volume.h"

namespace strandcast {
namespace {

struct Way {
  const char* name;
  const char* what;
};
constexpr Way kHost = {"host", "sorted by layers on the processors, summed in double"};
constexpr Way kInUse[] = {{"sort", "sorted by cells, integer sums of each cell in registers"},
                          {"atomics", "32 integer atomic additions a sample"}};
constexpr Way kTried[] = {
    {"raster", "points drawn into the layers of a texture, blending sums (Woodhouse's choice)"},
    {"counting", "samples sorted into cells, nodes visit those around them (Woodhouse's second)"},
    {"hashing", "bins by the sides of 20 random planes, nodes visit their own (Woodhouse's first)"}};

class ScatterStudy {
 public:
  ScatterStudy(const ScatterStudyDesc& desc, HairVolume volume)
      : desc_(desc),
        volume_(std::move(volume)),
        position_(desc.layout.strand_count, desc.layout.vertex_count),
        velocity_(desc.layout.strand_count, desc.layout.vertex_count),
        nodes_(volume_.most_nodes()) {
    pack_blocks(std::span<const glm::vec3>(desc.position_m), position_);
    pack_blocks(std::span<const glm::vec3>(desc.velocity_mps), velocity_);
  }

  Status run(VolumeStudy& study) {
    measure(
        study, kHost, true, [&] { update_host(); },
        [&] {
          return std::vector<glm::vec4>(nodes_.begin(),
                                        nodes_.begin() + static_cast<std::ptrdiff_t>(volume_.grid().size()));
        });
    study.scatter_resolution = desc_.resolution;
    study.scatter_samples = samples_.size();
    RETURN_IF_ERROR(run_in_use(study));
    return study.scatter_device.empty() ? Status() : run_tried(study);
  }

 private:
  void update_host() {
    VolumeInput input;
    input.position_m = position_.view();
    input.velocity_mps = velocity_.view();
    volume_.update(input, nodes_);
  }

  /// As HairVolume takes them, each in double, and in the grid's cells.
  void take_samples() {
    const StrandLayout& layout = desc_.layout;
    const uint32_t parts = volume_.segment_samples();
    for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
      for (uint32_t vertex = parts > 1 ? 1 : 0; vertex < layout.vertex_count; ++vertex) {
        const size_t at = layout.index(vertex, strand);
        const size_t before = parts > 1 ? at - layout.strand_count : at;
        const size_t row = size_t{strand / kBlockStrands} * layout.vertex_count + vertex;
        const float length_m = volume_.sample_lengths_m()[row * kBlockStrands + strand % kBlockStrands] /
                               static_cast<float>(parts);
        if (!(length_m > 0.0f)) continue;
        for (uint32_t part = 0; part < parts; ++part) {
          const double share = parts > 1 ? (part + 0.5) / parts : 0.0;
          const auto between = [&](const std::vector<glm::vec3>& plane) {
            return glm::mix(glm::dvec3(plane[before]), glm::dvec3(plane[at]), share);
          };
          samples_.push_back(
              {between(desc_.position_m), between(desc_.velocity_mps), static_cast<double>(length_m)});
        }
      }
    const VolumeGrid& grid = volume_.grid();
    for (const HairSample& sample : samples_) {
      const glm::vec3 place(sample.in_head_m / static_cast<double>(grid.cell_m) - glm::dvec3(grid.first));
      const glm::vec3 motion(sample.velocity_mps);
      records_.push_back({{place.x, place.y, place.z},
                          static_cast<float>(sample.length_m),
                          {motion.x, motion.y, motion.z},
                          0.0f});
    }
  }

  template <class Work, class Read>
  void measure(VolumeStudy& study, const Way& way, bool is_in_use, const Work& work, const Read& read) {
    work();  // the first one allocates
    if (samples_.empty()) {
      take_samples();
      truth_ = make_reference_volume(volume_.grid(), samples_, 0);
    }
    ScatterResult result{.name = way.name, .what = way.what, .is_in_use = is_in_use};
    const std::vector<glm::vec4> first = read();
    std::vector<double> times_ms;
    for (uint32_t round = 0; round < desc_.rounds; ++round) {
      const double begin_ms = process_cpu_ms();
      work();
      times_ms.push_back(process_cpu_ms() - begin_ms);
      const std::vector<glm::vec4> again = read();
      result.is_repeatable = result.is_repeatable && again.size() == first.size() &&
                             std::memcmp(again.data(), first.data(), first.size() * sizeof(glm::vec4)) == 0;
    }
    result.cpu_ms = median(times_ms);
    compare(first, result);
    study.scatters.push_back(result);
  }

  void compare(const std::vector<glm::vec4>& nodes, ScatterResult& result) const {
    double density_off = 0.0, density_whole = 0.0, momentum_off = 0.0, momentum_whole = 0.0;
    for (size_t i = 0; i < truth_.nodes.size(); ++i) {
      const glm::dvec4 found = i < nodes.size() ? glm::dvec4(nodes[i]) : glm::dvec4(0.0);
      const glm::dvec4& truth = truth_.nodes[i];
      density_off += (found.w - truth.w) * (found.w - truth.w);
      density_whole += truth.w * truth.w;
      const glm::dvec3 off = found.w * glm::dvec3(found) - truth.w * glm::dvec3(truth);
      momentum_off += glm::dot(off, off);
      momentum_whole += truth.w * truth.w * glm::dot(glm::dvec3(truth), glm::dvec3(truth));
    }
    constexpr double kLeast = std::numeric_limits<double>::min();
    result.density = std::sqrt(density_off / std::max(density_whole, kLeast));
    result.momentum = std::sqrt(momentum_off / std::max(momentum_whole, kLeast));
  }

  Status run_in_use(VolumeStudy& study) {
    auto executor = make_gl_executor(desc_.gl_device);
    if (!executor) return {};  // said by an empty device
    study.scatter_device = (*executor)->info().name;
    const StrandLayout& layout = desc_.layout;
    StepBlock step{};
    step.world_from_head = {glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(0, 0, 1, 0)};
    step.shape = {layout.strand_count, layout.vertex_count, 1u, layout.vertex_count};
    const auto plane_of = [&](const char* label, const std::vector<glm::vec3>& values) {
      std::vector<glm::vec4> plane;
      for (const glm::vec3& value : values) plane.emplace_back(value, 0.0f);
      return (*executor)->make_plane(label, layout.strand_count, plane);
    };
    const auto position = plane_of("position", desc_.position_m);
    const auto velocity = plane_of("velocity", desc_.velocity_mps);
    ASSIGN_OR_RETURN(const auto table,
                     (*executor)->make_table("volume", static_cast<uint32_t>(2 + volume_.most_nodes())));
    for (const Way& way : kInUse) {
      DeviceVolumeDesc desc;
      desc.scatter = way.name;
      desc.volume = &volume_;
      desc.strand_count = layout.strand_count;
      desc.vertex_count = layout.vertex_count;
      desc.smoothing = 0;
      desc.is_ahead = false;
      ASSIGN_OR_RETURN(const auto volume, (*executor)->make_volume(desc));
      measure(
          study, way, true,
          [&] { timed_ms(**executor, [&] { volume->update(step, *position, *velocity, *table); }); },
          [&] {
            std::vector<glm::vec4> nodes;
            volume->read_nodes(*table, nodes);
            return nodes;
          });
    }
    return {};
  }

  Status run_tried(VolumeStudy& study) {
    ASSIGN_OR_RETURN(const auto context, gl::EglContext::make(desc_.gl_device));
    const gl::ShaderLibrary shaders;
    for (const Way& way : kTried) {
      ASSIGN_OR_RETURN(const auto scatter, make_gl_scatter_study(shaders, context->info().limits, way.name,
                                                                 volume_.grid(), records_));
      measure(
          study, way, false,
          [&] {
            scatter->run();
            scatter->wait();
          },
          [&] { return scatter->read_nodes(); });
      study.scatters.back().lost_share =
          static_cast<double>(scatter->lost_count()) / static_cast<double>(records_.size());
    }
    return {};
  }

  const ScatterStudyDesc& desc_;
  HairVolume volume_;
  StrandBlocks position_, velocity_;
  std::vector<glm::vec4> nodes_;
  std::vector<HairSample> samples_;
  std::vector<VolumeRecord> records_;
  ReferenceVolume truth_;
};

}  // namespace

Status study_scatters(const ScatterStudyDesc& desc, VolumeStudy& study) {
  const StrandLayout& layout = desc.layout;
  ASSIGN_OR_RETURN(
      HairVolume volume,
      HairVolume::make({layout.strand_count, layout.vertex_count, layout.rest, {}}, {desc.resolution, 0}));
  return ScatterStudy(desc, std::move(volume)).run(study);
}

}  // namespace strandcast
