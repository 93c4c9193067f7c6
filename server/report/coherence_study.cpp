#include "server/report/coherence_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "server/report/crowded_hair.h"
#include "server/report/view_painter.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr const char* kRod = "direct_rod";
constexpr const char* kSagFreeParameter = "sag_free";
constexpr double kUsualRateHz = 60.0;
constexpr HairCompany kAlone{};
constexpr HairCompany kContact{true, false};
constexpr HairCompany kAir{false, true};
constexpr HairCompany kFull{true, true};

constexpr double kHeadHeightM = 1.6;
constexpr double kShakeEaseS = 0.25;
constexpr uint32_t kMostSubsteps = 64;
/// So far that hair which stands off is in the picture, and when in the shake: in eighths of its period.
constexpr double kPictureDistanceM = 0.95;
constexpr double kPictureEighths[] = {0.0, 1.0, 2.0, 3.0, 4.0};

/// Smooth from 0 to 1.
double smooth_share(double share) {
  const double held = std::clamp(share, 0.0, 1.0);
  return held * held * (3.0 - 2.0 * held);
}

/// The vertices of a run in double: in the world, to know how fast they are, and as seen from the head.
class SeenStrands {
 public:
  explicit SeenStrands(const HairRun& run) : run_(run) {}

  void take(const Pose& world_from_head) {
    std::swap(before_in_world_m_, in_world_m_);
    in_world_m_.clear();
    for (const glm::vec3& point : run_.position_in_head_m())
      in_world_m_.push_back(world_from_head * glm::dvec3(point));
  }
  /// In the world, of so many vertices from the roots on.
  double fastest_mps(uint32_t vertex_count) const {
    double fastest_m = 0.0;
    for (size_t i = 0; i < size_t{vertex_count} * run_.layout().strand_count; ++i)
      fastest_m = std::max(fastest_m, glm::distance(in_world_m_[i], before_in_world_m_[i]));
    return run_.scene().step_rate_hz * fastest_m;
  }
  /// In head space.
  Coherence coherence() const {
    const std::vector<glm::dvec3> position_m(run_.position_in_head_m().begin(),
                                             run_.position_in_head_m().end());
    const std::vector<glm::dvec3> velocity_mps(run_.velocity_in_head_mps().begin(),
                                               run_.velocity_in_head_mps().end());
    return measure_coherence(
        {run_.layout().strand_count, run_.layout().vertex_count, position_m, velocity_mps});
  }

 private:
  const HairRun& run_;
  std::vector<glm::dvec3> in_world_m_, before_in_world_m_;
};

/// What pictures of a row are drawn by, and where they go.
struct RowPictures {
  ViewPainter* painter = nullptr;  // nullptr: none are drawn
  std::vector<double> times_s;
  std::vector<Image> pictures;
};

/// The shake of one row, and its rest.
class RowRun {
 public:
  RowRun(const CoherenceStudyDesc& desc, const CoherenceRow& row, HairRun run)
      : desc_(desc), run_(std::move(run)), strands_(run_) {
    outcome_.row = row;
    outcome_.substeps = run_.scene().substeps;
  }

  Status shake(RowPictures& drawn) {
    const double rate_hz = run_.scene().step_rate_hz;
    const auto steps = std::llround(desc_.shake_s * rate_hz);
    const auto begin = std::llround(desc_.settle_s * rate_hz);
    const auto interval = std::max<int64_t>((steps - begin) / desc_.moments, 1);
    double vertex_mps = 0.0, scalp_mps = 0.0;
    size_t next_picture = 0;
    for (int64_t step = 1; step <= steps; ++step) {
      go();
      if (drawn.painter != nullptr && next_picture < drawn.times_s.size() &&
          run_.time_s() + 0.5 / rate_hz > drawn.times_s[next_picture]) {
        ++next_picture;
        const PosedStrands strands{head_, run_.position_in_head_m()};
        ASSIGN_OR_RETURN(Image picture, drawn.painter->image(strands, kPictureDistanceM));
        drawn.pictures.push_back(std::move(picture));
      }
      if (step <= begin) continue;
      vertex_mps = std::max(vertex_mps, strands_.fastest_mps(run_.layout().vertex_count));
      scalp_mps = std::max(scalp_mps, strands_.fastest_mps(1));
      if ((step - begin) % interval == 0) measure();
    }
    outcome_.fastest_over_scalp = vertex_mps / scalp_mps;
    return {};
  }

  CoherenceOutcome rest() {
    const double rate_hz = run_.scene().step_rate_hz;
    const auto steps = std::max<int64_t>(std::llround(desc_.hold_s * rate_hz), 1);
    const int64_t looked = std::clamp<int64_t>(std::llround(desc_.look_s * rate_hz), 1, steps);
    double speeds = 0.0;
    for (int64_t step = 0; step < steps; ++step) {
      go();
      if (step + looked < steps) continue;
      for (const glm::vec3& velocity : run_.velocity_in_head_mps())
        speeds += glm::dot(glm::dvec3(velocity), glm::dvec3(velocity));
    }
    const auto vertices = static_cast<double>(run_.layout().size());
    double off = 0.0;
    for (size_t i = 0; i < run_.layout().size(); ++i) {
      const glm::dvec3 way = glm::dvec3(run_.position_in_head_m()[i]) - glm::dvec3(run_.layout().rest[i]);
      off += glm::dot(way, way);
    }
    outcome_.rest_rms_m = std::sqrt(off / vertices);
    outcome_.rest_speed_mps = std::sqrt(speeds / (vertices * static_cast<double>(looked)));
    outcome_.step_cpu_ms = run_.cpu_ms() / static_cast<double>(run_.steps());
    return outcome_;
  }

 private:
  void go() {
    head_ = yawed_head(run_.time_s() + 1.0 / run_.scene().step_rate_hz, desc_.shake_s);
    run_.step(head_);
    strands_.take(head_);
  }
  void measure() {
    const Coherence found = strands_.coherence();
    outcome_.coherence += found;
    outcome_.moments.push_back({run_.time_s(), found.incoherent_share()});
  }

  const CoherenceStudyDesc& desc_;
  HairRun run_;
  SeenStrands strands_;
  Pose head_;
  CoherenceOutcome outcome_;
};

Result<CoherenceOutcome> run_row(const CoherenceStudyDesc& desc, const CoherenceRow& row,
                                 const SceneContent& content, Executor& executor, RowPictures& drawn) {
  ASSIGN_OR_RETURN(const SceneDesc scene, scene_of_row(row, desc.scene));
  ASSIGN_OR_RETURN(HairRun run, HairRun::make(executor, scene, content));
  RowRun row_run(desc, row, std::move(run));
  RETURN_IF_ERROR(row_run.shake(drawn));
  return row_run.rest();
}

/// Pictures of one size in rows of so many.
Image tiled(const std::vector<Image>& pictures, size_t columns) {
  Image sheet;
  if (pictures.empty()) return sheet;
  const uint32_t width = pictures.front().width, height = pictures.front().height;
  sheet.width = width * static_cast<uint32_t>(columns);
  sheet.height = height * static_cast<uint32_t>(pictures.size() / columns);
  sheet.rgba.resize(size_t{sheet.width} * sheet.height * 4);
  for (size_t k = 0; k < pictures.size(); ++k)
    for (uint32_t y = 0; y < height; ++y) {
      const size_t row = k / columns * height + y;
      const size_t to = 4 * (row * sheet.width + k % columns * width);
      std::copy_n(pictures[k].rgba.begin() + static_cast<std::ptrdiff_t>(size_t{4} * y * width),
                  size_t{4} * width, sheet.rgba.begin() + static_cast<std::ptrdiff_t>(to));
    }
  return sheet;
}

}  // namespace

std::vector<CoherenceRow> coherence_rows(bool is_whole) {
  std::vector<CoherenceRow> rows;
  for (const SolverRow& solver : solver_table())
    if (solver.has_kernel)
      rows.push_back(
          {solver.name, solver.name, kAlone, kUsualRateHz, solver.name == kRod || solver.name == "dftl"});
  rows.push_back({"direct_rod + contact", kRod, kContact, kUsualRateHz, true});
  rows.push_back({"direct_rod + air", kRod, kAir, kUsualRateHz, false});
  rows.push_back({"direct_rod, full", kRod, kFull, kUsualRateHz, true});
  if (!is_whole) return rows;
  for (const double rate_hz : {30.0, 240.0})
    rows.push_back({fmt::format("direct_rod, full, {:g} Hz", rate_hz), kRod, kFull, rate_hz, false,
                    rate_hz < kUsualRateHz ? 2u : 1u});
  for (const SolverRow& solver : solver_table())
    if (solver.has_kernel && solver.name != kRod)
      rows.push_back({solver.name + (solver.bears_volume ? ", full" : " + air"), solver.name,
                      solver.bears_volume ? kFull : kAir, kUsualRateHz, false});
  return rows;
}

Pose yawed_head(double time_s, double shake_s) {
  const double share =
      smooth_share(time_s / kShakeEaseS) * (1.0 - smooth_share((time_s - shake_s) / kShakeEaseS));
  const double yaw_rad =
      share * glm::radians(kShakeYawDeg) * std::sin(2.0 * std::numbers::pi * kShakeHz * time_s);
  return {{0.0, kHeadHeightM, 0.0}, glm::angleAxis(yaw_rad, glm::dvec3(0.0, 1.0, 0.0))};
}

Result<SceneDesc> scene_of_row(const CoherenceRow& row, const SceneDesc& scene) {
  ASSIGN_OR_RETURN(const SolverRow* solver, find_solver(row.solver));
  SceneDesc changed = scene;
  changed.wind = {};
  changed.solver = {row.solver, {}};
  for (const SolverParameterInfo& info : solver->parameters)
    if (info.name == kSagFreeParameter) changed.solver.parameters[kSagFreeParameter] = 1.0;
  const AirDesc air = scene.volume.air;
  changed.volume = volume_of(row.company);
  changed.volume.air.hairs = air.hairs;
  changed.volume.air.lock_width_m = air.lock_width_m;
  changed.step_rate_hz = row.step_rate_hz;
  ASSIGN_OR_RETURN(const SolverParameters parameters,
                   complete_parameters(*solver, changed.solver.parameters));
  for (changed.substeps = row.least_substeps; changed.substeps < kMostSubsteps; changed.substeps *= 2)
    if (check_step(*solver, parameters, 1.0 / (changed.step_rate_hz * changed.substeps))) break;
  return changed;
}

Result<CoherenceOutcome> measure_row(const CoherenceStudyDesc& desc, const CoherenceRow& row,
                                     Executor& executor) {
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(desc.scene));
  RowPictures drawn;
  return run_row(desc, row, content, executor, drawn);
}

Result<CoherenceStudy> run_coherence_study(const CoherenceStudyDesc& desc, Executor& executor,
                                           const CoherenceProgress& progress) {
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(desc.scene));
  CoherenceStudy study;
  study.strand_count = content.groom.strand_count();
  study.vertex_count = content.groom.uniform_vertex_count();
  study.device = executor.info().name;
  std::unique_ptr<ViewPainter> painter;
  RowPictures drawn;
  if (desc.has_pictures) {
    ASSIGN_OR_RETURN(painter, ViewPainter::make(desc.scene, desc.picture_size));
    for (const double eighths : kPictureEighths)
      drawn.times_s.push_back(desc.settle_s + eighths / (8.0 * kShakeHz));
  }
  for (const CoherenceRow& row : desc.rows) {
    progress(row.name);
    drawn.painter = row.is_main ? painter.get() : nullptr;
    ASSIGN_OR_RETURN(CoherenceOutcome outcome, run_row(desc, row, content, executor, drawn));
    study.outcomes.push_back(std::move(outcome));
    if (drawn.painter != nullptr) study.sheet_rows.push_back(row.name);
  }
  study.sheet = tiled(drawn.pictures, std::size(kPictureEighths));
  study.sheet_times_s = std::move(drawn.times_s);
  ASSIGN_OR_RETURN(study.reality, measure_reality(desc.reality, executor, progress));
  return study;
}

}  // namespace strandcast
