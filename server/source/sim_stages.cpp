#include "server/source/sim_stages.h"

#include <utility>

#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr uint64_t kVec4Bytes = sizeof(glm::vec4);
constexpr uint64_t kVec3Bytes = sizeof(glm::vec3);
/// Per vertex of a solver that is not built yet: rest, position and velocity.
constexpr uint64_t kStateBytes = 3 * kVec4Bytes;

/// A stage that is one call of somebody else's function.
class Stage final : public gl::Pass<StageTurn> {
 public:
  using Work = void (*)(StageTurn&);
  Stage(gl::PassDeclaration declaration, gl::PassClock clock, Work work)
      : Pass(std::move(declaration), clock), work_(work) {}
  Status run(StageTurn& turn) override {
    work_(turn);
    return {};
  }

 private:
  Work work_;
};

void carry(StageTurn& turn) {
  if (turn.shared != nullptr) return;  // a tick says it
  const SceneStep& step = turn.builder.step();
  if (step.carried_to_rotation && !turn.is_carried) turn.solver.rebase(*step.carried_to_rotation);
  turn.is_carried = true;
}

void gather_volume(StageTurn& turn) {
  carry(turn);
  if (turn.shared == nullptr) turn.solver.gather(turn.builder.step().substeps.front());
}

void run_substeps(StageTurn& turn) {
  if (turn.shared != nullptr) {
    turn.shared->step(turn.builder.step_tick(turn.tick), turn.builder.step_scene(*turn.features),
                      turn.step_rate_hz);
    return;
  }
  carry(turn);
  const SceneStep& step = turn.builder.step();
  for (const StepInput& substep : step.substeps) {
    if (turn.is_stopping != nullptr && *turn.is_stopping) return;  // many of a slow solver take long
    turn.solver.substep(substep);
  }
}

const FeatureReason& fact(const std::vector<FeatureReason>& reasons, const std::string& name) {
  for (const FeatureReason& reason : reasons)
    if (reason.name == name) return reason;
  CHECK(!"explain() names every fact");
  return reasons.front();
}

}  // namespace

SimStages::SimStages(const StageSizes& sizes, const std::vector<FeatureReason>& reasons)
    : sizes_(sizes),
      state_(std::make_unique<KnownLater>("strand state",
                                          kStateBytes * sizes.strand_count * sizes.vertex_count)),
      host_state_("state on the host", 2 * kVec3Bytes * sizes.strand_count * sizes.vertex_count),
      snapshot_("snapshot", kVec3Bytes * sizes.strand_count * sizes.vertex_count) {
  plan_step(sizes.substeps, reasons);
}

/// Times go on where nothing has changed.
void SimStages::plan_publish(const FeatureReason& follows) {
  const FeatureReason planned = std::exchange(publish_planned_for_, follows);
  if (publish_ != nullptr && planned.value == follows.value && planned.reason == follows.reason) return;
  publish_ = std::make_unique<gl::PassList<StageTurn>>();
  const auto add = [this](gl::PassDeclaration declaration, Stage::Work work) {
    publish_->add(std::make_unique<Stage>(std::move(declaration), gl::PassClock::Host, work));
  };
  gl::Resources read = {state_.get()};
  if (follows.value) read.push_back(&followed_);
  add({"publish/follow", {state_.get()}, {&followed_}, follows.value, follows.reason},
      [](StageTurn& turn) { turn.solver.follow_guides(); });
  add({"publish/read", read, {&host_state_}, true, {}}, [](StageTurn& turn) {
    turn.publisher.read(turn.shared != nullptr ? turn.shared->read_blocks() : turn.solver.read_blocks());
  });
  add({"publish/quantise", {&host_state_}, {&snapshot_}, true, {}}, [](StageTurn& turn) {
    turn.publish.head_velocity_mps = turn.builder.head_velocity_mps();
    turn.snapshot = turn.publisher.quantise(turn.publish);
  });
  CHECK(publish_->plan({state_.get()}, {&snapshot_}).ok());
}

void SimStages::plan_step(uint32_t substeps, const std::vector<FeatureReason>& reasons) {
  sizes_.substeps = substeps;
  const FeatureReason& vertices = fact(reasons, "has_fewer_vertices");
  plan_publish(vertices.value ? vertices : fact(reasons, "has_followed_strands"));
  step_ = std::make_unique<gl::PassList<StageTurn>>();
  const auto resource = [this](const char* name, uint64_t size_bytes) {
    return &step_->keep(std::make_unique<gl::Resource>(name, size_bytes));
  };
  const gl::Resource* motion = resource("substeps", sizes_.substeps * sizeof(StepInput));
  const gl::Resource* wind = resource("wind", sizes_.substeps * sizeof(glm::dvec3));
  const gl::Resource* gusts = resource("gusts", sizes_.substeps * kMaxGustWaves * sizeof(GustWave));
  const gl::Resource* colliders =
      resource("colliders", sizes_.substeps * sizes_.collider_count * sizeof(SphereCollider));
  const gl::Resource* limits = resource("follicle limits", sizes_.substeps * sizeof(double));
  const gl::Resource* bends = resource("bend limits", sizeof(BendLimitDesc));
  const gl::Resource* drag = resource("oriented drag", sizeof(WindDesc::along_share));
  const gl::Resource* body = resource("body", sizes_.substeps * (kMaxBodyCapsules * sizeof(BodyCapsule) +
                                                                 kMaxBodyPlanes * sizeof(BodyPlane)));
  const gl::Resource* field = resource("distance field", sizes_.field_bytes);
  gl::Resources read_by_solver = {motion};
  const auto add = [&](const char* name, const gl::Resource* written, const FeatureReason& reason,
                       Stage::Work work) {
    if (reason.value && written != motion) read_by_solver.push_back(written);
    step_->add(
        std::make_unique<Stage>(gl::PassDeclaration{name, {&input_}, {written}, reason.value, reason.reason},
                                gl::PassClock::Host, work));
  };
  add("scene/motion", motion, {"", true, ""},
      [](StageTurn& turn) { turn.builder.begin(turn.input, turn.end_time_s, turn.input_rate); });
  add("scene/wind", wind, fact(reasons, "has_wind"), [](StageTurn& turn) { turn.builder.add_wind(); });
  add("scene/gusts", gusts, fact(reasons, "has_turbulence"),
      [](StageTurn& turn) { turn.builder.add_gusts(); });
  add("scene/colliders", colliders, fact(reasons, "has_colliders"),
      [](StageTurn& turn) { turn.builder.add_colliders(); });
  add("scene/follicle_limit", limits, fact(reasons, "has_follicle_limit"),
      [](StageTurn& turn) { turn.builder.add_follicle_limit(); });
  // The solver's own: kernels before and after its own one.
  add("scene/oriented_drag", drag, fact(reasons, "has_oriented_drag"), [](StageTurn&) {});
  add("scene/bend_limit", bends, fact(reasons, "has_bend_limit"), [](StageTurn&) {});
  add("scene/body", body, fact(reasons, "has_body"), [](StageTurn& turn) { turn.builder.add_body(); });
  // Made at load; strands look it up where they are.
  add("scene/distance_field", field, fact(reasons, "has_distance_field"), [](StageTurn&) {});
  const FeatureReason& has_volume = fact(reasons, "has_volume");
  const gl::Resource* volume = resource("hair volume", 0);  // the solver's, counted with its state
  if (has_volume.value) read_by_solver.push_back(volume);
  step_->add(std::make_unique<Stage>(
      gl::PassDeclaration{"sim/volume", {motion}, {volume}, has_volume.value, has_volume.reason},
      gl::PassClock::Device, gather_volume));
  const FeatureReason& carried = fact(reasons, "is_carried");
  step_->add(std::make_unique<Stage>(
      gl::PassDeclaration{"sim/step", read_by_solver, {state_.get()}, !carried.value, carried.reason},
      gl::PassClock::Device, run_substeps));
  CHECK(step_->plan({&input_}, {state_.get()}).ok());
}

gl::PassReports SimStages::report() const {
  gl::PassReports reports = step_->report();
  for (gl::PassReport& report : publish_->report()) {
    if (!is_watched_ && report.fate == gl::PassFate::Kept)
      report.reason =
          fmt::format("every {} steps, to find broken strands: nobody watches", kIdlePublishSteps);
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace strandcast
