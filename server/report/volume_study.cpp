#include "server/report/volume_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <utility>

#include "common/base/quantile.h"
#include "common/kernels/volume/hair_volume.h"
#include "common/math/point_tree.h"
#include "server/report/crowded_hair.h"
#include "server/report/process_time.h"

namespace strandcast {
namespace {

/// Rates of the volume, and the tuft that is shaken.
constexpr double kFrictionPerS = 20.0;
constexpr double kRepulsionPerS2 = 18'000.0;
constexpr float kTuftLengthM = 0.2f;
constexpr uint32_t kTuftVertices = 16;
constexpr uint32_t kTuftSeed = 1;
/// Cells of a tuft of so few strands, and what it is looked at by.
constexpr uint32_t kTuftResolution = 12;

/// All strands at one moment, and some steps before it.
struct Moment {
  std::vector<std::vector<glm::vec3>> position_m;    // [steps before](vertex_count x strand_count) head space
  std::vector<std::vector<glm::vec3>> velocity_mps;  // relative to the head, head axes
};

/// The first strands of a row-major plane.
template <class T>
std::vector<T> first_strands(const std::vector<T>& plane, uint32_t strand_count, uint32_t count) {
  std::vector<T> part;
  for (size_t row = 0; row < plane.size(); row += strand_count)
    part.insert(part.end(), plane.begin() + static_cast<std::ptrdiff_t>(row),
                plane.begin() + static_cast<std::ptrdiff_t>(row + count));
  return part;
}

/// Hairs that each of the first strands stands for: those whose roots are nearest to its own.
std::vector<float> hairs_of_guides(const StrandLayout& layout, uint32_t guide_count) {
  std::vector<glm::vec3> roots;
  for (uint32_t strand = 0; strand < guide_count; ++strand) roots.emplace_back(layout.rest[strand]);
  const PointTree tree(roots);
  std::vector<float> hairs(guide_count, 0.0f);
  for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
    hairs[strand < guide_count ? strand : tree.nearest(glm::vec3(layout.rest[strand]), 1).front().index] +=
        1.0f;
  return hairs;
}

Result<std::vector<Moment>> record_moments(const VolumeStudyDesc& desc, const SceneContent& content,
                                           Executor& executor) {
  ASSIGN_OR_RETURN(HairRun run, HairRun::make(executor, desc.scene, content));
  const uint32_t depth = *std::max_element(desc.intervals.begin(), desc.intervals.end());
  const auto steps = std::max<int64_t>(std::llround(desc.seconds * desc.scene.step_rate_hz), desc.moments);
  std::deque<std::pair<std::vector<glm::vec3>, std::vector<glm::vec3>>> last;
  std::vector<Moment> moments;
  for (int64_t step = 1; step <= steps; ++step) {
    run.step(shaken_head(static_cast<double>(step) / desc.scene.step_rate_hz));
    last.emplace_front(run.position_in_head_m(), run.velocity_in_head_mps());
    if (last.size() > depth) last.pop_back();
    if (step * desc.moments / steps == (step - 1) * desc.moments / steps) continue;
    Moment moment;
    for (const auto& [position_m, velocity_mps] : last) {
      moment.position_m.push_back(position_m);
      moment.velocity_mps.push_back(velocity_mps);
    }
    while (moment.position_m.size() < depth) {
      moment.position_m.push_back(moment.position_m.back());
      moment.velocity_mps.push_back(moment.velocity_mps.back());
    }
    moments.push_back(std::move(moment));
  }
  return moments;
}

/// A volume and room for what goes in and out of it.
class Sampled {
 public:
  static Result<Sampled> make(const VolumeStrands& strands, uint32_t resolution, uint32_t smoothing) {
    ASSIGN_OR_RETURN(HairVolume volume, HairVolume::make(strands, {resolution, smoothing}));
    return Sampled(strands, std::move(volume));
  }
  void fill(const std::vector<glm::vec3>& position_m, const std::vector<glm::vec3>& velocity_mps) {
    pack_blocks(std::span<const glm::vec3>(position_m), position_);
    pack_blocks(std::span<const glm::vec3>(velocity_mps), velocity_);
  }
  void update() {
    VolumeInput input;
    input.position_m = position_.view();
    input.velocity_mps = velocity_.view();
    volume_.update(input, nodes_);
  }
  std::vector<VolumeSample> at(const std::vector<glm::vec3>& points_m) const {
    std::vector<VolumeSample> samples;
    for (const glm::vec3& point : points_m)
      samples.push_back(sample_volume(volume_.grid(), nodes_, glm::dvec3(point)));
    return samples;
  }
  float cell_m() const { return volume_.cell_m(); }

 private:
  Sampled(const VolumeStrands& strands, HairVolume volume)
      : volume_(std::move(volume)),
        position_(strands.strand_count, strands.vertex_count),
        velocity_(strands.strand_count, strands.vertex_count),
        nodes_(volume_.most_nodes()) {}

  HairVolume volume_;
  StrandBlocks position_, velocity_;
  std::vector<glm::vec4> nodes_;
};

/// Sums of squares of differences and of what they are compared with.
struct Squares {
  double off = 0.0;
  double whole = 0.0;
  double share() const { return std::sqrt(off / std::max(whole, std::numeric_limits<double>::min())); }
};

struct ErrorSquares {
  Squares density, gradient, velocity;

  void add(const std::vector<VolumeSample>& found, const std::vector<VolumeSample>& truth) {
    for (size_t i = 0; i < truth.size(); ++i) {
      const double density_off = found[i].density_mpm3 - truth[i].density_mpm3;
      density.off += density_off * density_off;
      density.whole += truth[i].density_mpm3 * truth[i].density_mpm3;
      const glm::dvec3 gradient_off = found[i].gradient_mpm4 - truth[i].gradient_mpm4;
      gradient.off += glm::dot(gradient_off, gradient_off);
      gradient.whole += glm::dot(truth[i].gradient_mpm4, truth[i].gradient_mpm4);
      const glm::dvec3 velocity_off = found[i].velocity_mps - truth[i].velocity_mps;
      velocity.off += glm::dot(velocity_off, velocity_off);
      velocity.whole += glm::dot(truth[i].velocity_mps, truth[i].velocity_mps);
    }
  }
};

/// Measures at the guides' vertices how far each way to make a volume is from the finest one of all strands.
class ErrorStudy {
 public:
  ErrorStudy(const VolumeStudyDesc& desc, const StrandLayout& layout, std::vector<Moment> moments)
      : desc_(desc),
        layout_(layout),
        moments_(std::move(moments)),
        hairs_(hairs_of_guides(layout, desc.guide_count)) {
    guide_rest_ = first_strands(layout.rest, layout.strand_count, desc.guide_count);
  }

  Status run(const VolumeProgress& progress, std::vector<VolumeError>& errors) {
    RETURN_IF_ERROR(find_truth());
    for (const uint32_t resolution : desc_.resolutions) {
      progress(fmt::format("volumes of {} cells", resolution));
      for (const uint32_t smoothing : desc_.smoothings)
        for (const VolumeHairs hairs : {VolumeHairs::Guides, VolumeHairs::All})
          for (const uint32_t interval : desc_.intervals) {
            if (interval > 1 && (smoothing != kTrueSmoothing || hairs == VolumeHairs::All)) continue;
            ASSIGN_OR_RETURN(const VolumeError error, measure(resolution, smoothing, interval, hairs));
            errors.push_back(error);
          }
    }
    return {};
  }

 private:
  VolumeStrands strands_of(VolumeHairs hairs) const {
    if (hairs == VolumeHairs::All) return {layout_.strand_count, layout_.vertex_count, layout_.rest, {}};
    return {desc_.guide_count, layout_.vertex_count, guide_rest_, hairs_};
  }
  std::vector<glm::vec3> guides_of(const std::vector<glm::vec3>& plane) const {
    return first_strands(plane, layout_.strand_count, desc_.guide_count);
  }

  Status find_truth() {
    ASSIGN_OR_RETURN(Sampled truth,
                     Sampled::make(strands_of(VolumeHairs::All), kTrueResolution, kTrueSmoothing));
    for (const Moment& moment : moments_) {
      truth.fill(moment.position_m[0], moment.velocity_mps[0]);
      truth.update();
      points_m_.push_back(guides_of(moment.position_m[0]));
      truth_.push_back(truth.at(points_m_.back()));
    }
    return {};
  }

  Result<VolumeError> measure(uint32_t resolution, uint32_t smoothing, uint32_t interval,
                              VolumeHairs hairs) const {
    ASSIGN_OR_RETURN(Sampled volume, Sampled::make(strands_of(hairs), resolution, smoothing));
    VolumeError error{resolution, smoothing, interval, hairs, volume.cell_m()};
    ErrorSquares squares;
    std::vector<double> times_ms;
    for (size_t m = 0; m < moments_.size(); ++m) {
      const Moment& moment = moments_[m];
      const bool is_all = hairs == VolumeHairs::All;
      volume.fill(is_all ? moment.position_m[interval - 1] : guides_of(moment.position_m[interval - 1]),
                  is_all ? moment.velocity_mps[interval - 1] : guides_of(moment.velocity_mps[interval - 1]));
      volume.update();  // the first one allocates
      for (uint32_t round = 0; round < desc_.rounds; ++round) {
        const double begin_ms = process_cpu_ms();
        volume.update();
        times_ms.push_back(process_cpu_ms() - begin_ms);
      }
      squares.add(volume.at(points_m_[m]), truth_[m]);
    }
    error.density = squares.density.share();
    error.gradient = squares.gradient.share();
    error.velocity = squares.velocity.share();
    error.cpu_ms = median(times_ms) / interval;
    return error;
  }

  const VolumeStudyDesc& desc_;
  const StrandLayout& layout_;
  const std::vector<Moment> moments_;
  const std::vector<float> hairs_;
  std::vector<glm::vec4> guide_rest_;
  std::vector<std::vector<glm::vec3>> points_m_;
  std::vector<std::vector<VolumeSample>> truth_;
};

std::vector<std::pair<std::string, VolumeDesc>> ways_to_use() {
  VolumeDesc usual;
  usual.friction_per_s = kFrictionPerS;
  usual.repulsion_per_s2 = kRepulsionPerS2;
  usual.resolution = kTuftResolution;
  std::vector<std::pair<std::string, VolumeDesc>> ways = {{"no volume", {}}, {"as shipped", usual}};
  const auto add = [&](const std::string& name, auto change) {
    ways.emplace_back(name, usual);
    change(ways.back().second);
  };
  add("explicit, as in the sources", [](VolumeDesc& volume) { volume.integration = "explicit"; });
  add("without friction", [](VolumeDesc& volume) { volume.friction_per_s = 0.0; });
  add("without repulsion", [](VolumeDesc& volume) { volume.repulsion_per_s2 = 0.0; });
  for (const uint32_t resolution : {8u, 16u, 24u, 32u})
    add(fmt::format("{} cells", resolution), [=](VolumeDesc& volume) { volume.resolution = resolution; });
  for (const uint32_t smoothing : {0u, 2u})
    add(fmt::format("smoothed {} times", smoothing),
        [=](VolumeDesc& volume) { volume.smoothing = smoothing; });
  for (const uint32_t interval : {2u, 4u})
    add(fmt::format("every {} steps", interval), [=](VolumeDesc& volume) { volume.interval = interval; });
  return ways;
}

Result<VolumeOutcome> use(const VolumeStudyDesc& desc, const std::string& name, const VolumeDesc& volume,
                          Executor& executor) {
  SceneDesc scene = desc.scene;
  scene.volume = volume;
  scene.wind = {};
  ASSIGN_OR_RETURN(
      CrowdedHair hair,
      CrowdedHair::make(executor, scene, make_tuft(desc.tuft_strands, kTuftVertices, kTuftLengthM, kTuftSeed),
                        kTuftResolution));
  hair.shake(desc.shake_s);
  hair.hold(desc.hold_s);
  const RestFindings found = hair.look(desc.look_s);
  return VolumeOutcome{name,
                       volume,
                       found.speed_rms_mps,
                       found.nyquist_m,
                       found.volume_share,
                       found.crowded_share,
                       hair.run().cpu_ms() / static_cast<double>(hair.run().steps())};
}

}  // namespace

const char* to_string(VolumeHairs hairs) {
  return hairs == VolumeHairs::Guides ? "guides" : "all hairs";
}

Result<VolumeStudy> run_volume_study(const VolumeStudyDesc& desc, Executor& executor,
                                     const std::string& gl_device, const VolumeProgress& progress) {
  VolumeStudyDesc study_desc = desc;
  SceneDesc& scene = study_desc.scene;
  scene.wind = {};
  if (!scene.volume.acts()) {
    scene.volume.friction_per_s = kFrictionPerS;
    scene.volume.repulsion_per_s2 = kRepulsionPerS2;
  }
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  ASSIGN_OR_RETURN(const StrandLayout layout, make_strand_layout(content.groom));
  if (study_desc.guide_count == 0 || study_desc.guide_count > layout.strand_count)
    return make_error(ErrorCode::BadInput,
                      "{} guides of {} hairs: there have to be one or more, and no more than all",
                      study_desc.guide_count, layout.strand_count);
  VolumeStudy study;
  study.hair_count = layout.strand_count;
  study.guide_count = study_desc.guide_count;
  study.vertex_count = layout.vertex_count;
  progress(fmt::format("{} hairs in a shake of {:g} s", layout.strand_count, desc.seconds));
  ASSIGN_OR_RETURN(std::vector<Moment> moments, record_moments(study_desc, content, executor));
  progress("ways to get strands into a volume");
  RETURN_IF_ERROR(study_scatters({layout, moments.front().position_m[0], moments.front().velocity_mps[0],
                                  kTrueResolution, gl_device, desc.rounds},
                                 study));
  ErrorStudy errors(study_desc, layout, std::move(moments));
  RETURN_IF_ERROR(errors.run(progress, study.errors));
  for (const auto& [name, volume] : ways_to_use()) {
    progress(fmt::format("a tuft after a shake: {}", name));
    ASSIGN_OR_RETURN(const VolumeOutcome outcome, use(study_desc, name, volume, executor));
    study.outcomes.push_back(outcome);
  }
  return study;
}

}  // namespace strandcast
