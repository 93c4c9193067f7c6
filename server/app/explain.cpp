#include "server/app/explain.h"

#include <chrono>

#include "common/base/profile.h"
#include "common/gl/egl_context.h"
#include "common/gl/timer.h"
#include "common/groom/groom_asset.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"
#include "server/app/pass_table.h"
#include "server/source/scene_change.h"
#include "server/publish/publisher.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr int kWarmUpSteps = 3;
constexpr int kMeasuredSteps = 10;

std::string fact_text(const FeatureReason& fact) {
  return fmt::format("  {:<20} {:<4} {}\n", fact.name, fact.value ? "yes" : "no", fact.reason);
}

std::string size_text(uint64_t bytes) {
  constexpr double kKilobyte = 1e3;
  return fmt::format("{:.1f} kB", static_cast<double>(bytes) / kKilobyte);
}

}  // namespace

std::string list_solvers() {
  std::string text;
  for (const SolverRow& row : solver_table()) {
    text += fmt::format("{}\n  {}\n  {}\n", row.name, row.summary, row.source);
    if (!row.has_kernel) text += "  reference only: in double on one thread of the processor, slow\n";
    for (const SolverParameterInfo& info : row.parameters)
      text += fmt::format("    {:<24} {:>10g}  in {:g} .. {:g} {:<8} {}\n", info.name, info.default_value,
                          info.minimum, info.maximum, info.unit, info.summary);
  }
  return text;
}

Result<PassTimes> measure_passes(const SceneDesc& scene, const SceneContent& content,
                                 const RuntimeFacts& facts, const std::string& gl_device,
                                 const std::optional<std::filesystem::path>& shader_folder) {
  ASSIGN_OR_RETURN(auto context, gl::EglContext::make(gl_device));
  const gl::ShaderLibrary shaders = shader_folder ? gl::ShaderLibrary(*shader_folder) : gl::ShaderLibrary();
  const SceneFeatures features = analyse(scene, facts);
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  ASSIGN_OR_RETURN(auto solver, row->make_gpu(parameters, {&shaders, features}));
  RETURN_IF_ERROR(solver->load(content.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  ASSIGN_OR_RETURN(auto encoder, make_strand_encoder(scene.stream.codec));
  encoder->set_rest_shape(make_scene_asset(content.groom, {}).rest_position_m);
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(scene.stream.codec, scene.stream.bound_m));
  Publisher publisher(content.groom, quantum_m);
  StepBuilder builder(scene, content.colliders);
  gl::GpuTimer timer(context->info());
  StageTimer step_timer;
  StageTimer encode_timer;
  for (int step = 1; step <= kWarmUpSteps + kMeasuredSteps; ++step) {
    const SceneStep& scene_step = builder.build(InputFrame{}, features, step / scene.step_rate_hz);
    timer.begin();
    for (const StepInput& substep : scene_step.substeps) solver->substep(substep);
    const double step_ms = timer.end_ms();
    PublishInput input;
    input.tick = static_cast<uint64_t>(step);
    const auto snapshot = publisher.publish(*solver, input);
    const ScopedStage stage(encode_timer);
    (void)encoder->encode(*snapshot);
    if (step > kWarmUpSteps) step_timer.add_ms(step_ms);
  }
  return PassTimes{{"sim/step", step_timer.median_ms()},
                   {"publish/read", publisher.read_timer().median_ms()},
                   {"publish/quantise", publisher.quantise_timer().median_ms()},
                   {"encode/strands", encode_timer.median_ms()}};
}

Result<std::string> explain_scene(const SceneDesc& scene, const SceneAsset& asset, const RuntimeFacts& facts,
                                  const PassTimes& times) {
  RETURN_IF_ERROR(check_solver(scene));
  ASSIGN_OR_RETURN(const ServerPlan plan, make_server_plan(scene, asset, facts));
  std::string text = fmt::format(
      "Scene '{}': {} strands x {} vertices, solver {}, {:g} steps of {} substeps per s\n", scene.name,
      asset.strand_count, asset.vertex_count, scene.solver.name, scene.step_rate_hz, scene.substeps);
  text += fmt::format("Assumed: {} viewers of strands, {} of frames\n\nFacts\n", facts.strand_viewers,
                      facts.frame_viewers);
  for (const FeatureReason& reason : explain(scene, facts)) text += fact_text(reason);
  for (const FeatureReason& reason : explain(analyse_picture(asset, scene.look))) text += fact_text(reason);
  text += "\nPasses\n";
  for (size_t i = 0; i < plan.passes.size(); ++i) {
    const gl::PassDeclaration& pass = plan.passes[i];
    const gl::PassDecision& decision = plan.plan.passes[i];
    const auto time = times.find(pass.name);
    const bool has_time = decision.fate == gl::PassFate::Kept && time != times.end();
    text +=
        fmt::format("  {:<18} {:<14} {:>12}  {:>9}  {}\n", pass.name, gl::to_string(decision.fate),
                    size_text(written_bytes(plan, pass)),
                    has_time ? fmt::format("{:.2f} ms", time->second) : std::string("-"), decision.reason);
  }
  text += fmt::format("\nMemory: {} allocated, {} saved\n", size_text(plan.plan.live_bytes),
                      size_text(plan.plan.saved_bytes));
  return text;
}

}  // namespace strandcast
