#include "server/app/explain.h"

#include <utility>

#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/groom/groom_asset.h"
#include "common/render/render_device.h"
#include "common/strands/strand_codec.h"
#include "server/app/server_passes.h"
#include "server/encode/picture_encoder.h"
#include "server/encode/picture_painter.h"
#include "server/encode/strand_encode_worker.h"
#include "server/sim/executor/executor.h"
#include "server/sim/followed_solver.h"
#include "server/sim/solver_registry.h"
#include "server/source/auto_quality.h"
#include "server/source/scene_change.h"
#include "server/source/sim_stages.h"

namespace strandcast {
namespace {

constexpr int kMeasuredPictures = 3;

std::string fact_text(const FeatureReason& fact) {
  return fmt::format("  {:<20} {:<4} {}\n", fact.name, fact.value ? "yes" : "no", fact.reason);
}

std::string size_text(uint64_t bytes) {
  constexpr double kKilobyte = 1e3;
  return fmt::format("{:.1f} kB", static_cast<double>(bytes) / kKilobyte);
}

/// What is shared by all that is measured.
struct Bench {
  const SceneDesc& scene;
  const SceneAsset& asset;
  const RuntimeFacts& facts;
  Executor& executor;
  RenderDeviceConfig render;
  ThreadPasses passes;  // measured so far
  std::vector<double> step_ms;
  std::vector<EncodedFramePtr> frames;  // of the strands
};

bool is_watched(const RuntimeFacts& facts) {
  return facts.strand_viewers + facts.frame_viewers > 0;
}

/// Steps, publishes and, when somebody watches, encodes.
Status measure_strands(Bench& bench, const SceneContent& content) {
  const SceneDesc& scene = bench.scene;
  const SceneFeatures features = analyse(scene, bench.facts);
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  ASSIGN_OR_RETURN(std::unique_ptr<Solver> solver,
                   row->make(parameters, {.executor = &bench.executor,
                                          .features = features,
                                          .groom_gravity_in_head_mps2 = scene.gravity_mps2,
                                          .volume = scene.volume,
                                          .head_field = content.head_field,
                                          .bend_limit = scene.bend_limit,
                                          .volume_target = content.volume_target,
                                          .drag_along_share = scene.wind.along_share}));
  if (const SimulatedPart part = simulated_part(scene, bench.facts, content.groom); !part.is_all())
    solver = std::make_unique<FollowedSolver>(std::move(solver), part);
  RETURN_IF_ERROR(solver->load(content.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  ASSIGN_OR_RETURN(auto encoder, make_strand_encoder(scene.stream.codec));
  encoder->set_rest_shape(bench.asset.rest_position_m);
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(scene.stream.codec, scene.stream.bound_m));
  Publisher publisher(content.groom, quantum_m);
  StepBuilder builder(scene, content.colliders);
  SimStages stages(stage_sizes(scene, bench.asset), explain(scene, bench.facts));
  stages.set_solver_bytes(solver->memory_bytes());
  stages.set_watched(is_watched(bench.facts));
  StageTimer encode_timer;
  for (int step = 1; step <= kMeasuredSteps; ++step) {
    StageTurn turn(builder, *solver, publisher);
    turn.end_time_s = step / scene.step_rate_hz;
    turn.publish.tick = static_cast<uint64_t>(step);
    const int64_t begin_ns = now_ns();
    RETURN_IF_ERROR(stages.step(turn, bench.executor.timer()));
    bench.step_ms.push_back(static_cast<double>(now_ns() - begin_ns) / kMsInNs);
    RETURN_IF_ERROR(stages.publish(turn));
    if (!is_watched(bench.facts)) continue;
    const ScopedStage stage(encode_timer);
    if (EncodedFramePtr frame = encoder->encode(*turn.snapshot)) bench.frames.push_back(std::move(frame));
  }
  bench.passes.simulation = stages.report();
  bench.passes.strands = {strand_encode_report(0, is_watched(bench.facts), encode_timer)};
  return {};
}

/// Follows the strands, paints and codes pictures.
Status measure_pictures(Bench& bench) {
  PictureView view = assumed_view(bench.scene);
  ASSIGN_OR_RETURN(const auto device, RenderDevice::open(bench.render));
  view.size = fit_picture(view.size, device->info().is_software ? kSoftwareBudget : kHardwareBudget);
  ASSIGN_OR_RETURN(auto decoder, make_strand_decoder(bench.scene.stream.codec,
                                                     {bench.asset.strand_count, bench.asset.vertex_count}));
  decoder->set_rest_shape(bench.asset.rest_position_m);
  ASSIGN_OR_RETURN(auto renderer, device->make_renderer(bench.asset, bench.scene.look));
  ASSIGN_OR_RETURN(auto encoder, make_picture_encoder(view, bench.scene.stream.frame_rate_hz, 0));
  PictureTimers timers;
  StageTimer read_timer;
  for (size_t i = 0; i < bench.frames.size() && i < kMeasuredPictures; ++i) {
    const auto timed = [](StageTimer& timer, auto&& work) {
      const ScopedStage stage(timer);
      return work();
    };
    ASSIGN_OR_RETURN(const auto snapshot,
                     timed(timers.decode, [&] { return decoder->decode(bench.frames[i]->message); }));
    const PosedStrands strands{snapshot->world_from_head, positions_in_head(*snapshot)};
    RETURN_IF_ERROR(renderer->draw(strands, view.camera, view.size));
    const Image image = timed(read_timer, [&] { return renderer->read_image(); });
    RETURN_IF_ERROR(timed(timers.encode[static_cast<size_t>(view.codec)],
                          [&] { return encoder->encode(image, view.quality, {}); }));
  }
  gl::PassReports painted = renderer->passes().report();
  painted.push_back(read_back_report(read_timer));
  bench.passes.pictures = picture_passes(timers, painted, codec_bit(view.codec));
  return {};
}

/// As a server in real time chooses; what is printed besides is of the scene as it is.
std::string quality_text(const SceneDesc& scene, double step_ms) {
  if (scene.quality != kAutoQuality) return fmt::format("Quality: {}\n", scene.quality);
  if (step_ms <= 0.0) return "Quality: auto\n";
  const AutoQuality judged = auto_quality(step_ms, scene.step_rate_hz);
  return fmt::format("Quality: auto, {} here, as {}\n", judged.is_full ? kFullQuality : kFastQuality,
                     judged.reason);
}

std::string to_text(const gl::PassReports& passes) {
  std::string text;
  for (const gl::PassReport& pass : passes)
    text +=
        fmt::format("  {:<18} {:<14} {:>12}  {:>9}  {}\n", pass.name, gl::to_string(pass.fate),
                    size_text(pass.size_bytes),
                    pass.runs > 0 ? fmt::format("{:.2f} ms", pass.median_ms) : std::string("-"), pass.reason);
  return text;
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

Result<Measured> measure_passes(const SceneDesc& scene, const SceneContent& content,
                                const RuntimeFacts& facts, const MeasureConfig& config) {
  ASSIGN_OR_RETURN(const auto executor,
                   open_executor({config.sim_device, config.gl_device, config.shader_folder}));
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  Bench bench{scene, asset, facts, *executor, {config.renderer, config.gl_device, config.shader_folder},
              {},    {},    {}};
  RETURN_IF_ERROR(measure_strands(bench, content));
  if (facts.frame_viewers > 0) {
    RETURN_IF_ERROR(measure_pictures(bench));
  } else {
    ASSIGN_OR_RETURN(bench.passes.pictures,
                     plan_picture_passes(asset, scene.look, likely_renderer(config.renderer, scene.look), 0));
  }
  return Measured{executor->info().name, join_passes(std::move(bench.passes), facts.frame_viewers > 0),
                  median(bench.step_ms)};
}

Result<std::vector<std::string>> explain_groom(const SceneDesc& scene, const Groom& groom) {
  return prepare_solver(scene, groom, scene.gravity_mps2);
}

Result<std::string> explain_scene(const SceneDesc& scene, const SceneAsset& asset, const RuntimeFacts& facts,
                                  const Measured& measured, const std::vector<std::string>& groom_notes) {
  RETURN_IF_ERROR(check_solver(scene));
  std::string text = fmt::format(
      "Scene '{}': {} strands x {} vertices, solver {}, {:g} steps of {} substeps per s\n", scene.name,
      asset.strand_count, asset.vertex_count, scene.solver.name, scene.step_rate_hz, scene.substeps);
  text += quality_text(scene, measured.step_ms);
  if (!measured.sim_device.empty()) text += fmt::format("Simulated on: {}\n", measured.sim_device);
  text += fmt::format("Assumed: {} viewers of strands, {} of frames\n\nFacts\n", facts.strand_viewers,
                      facts.frame_viewers);
  for (const FeatureReason& reason : explain(scene, facts)) text += fact_text(reason);
  for (const FeatureReason& reason : explain(analyse_picture(asset, scene.look))) text += fact_text(reason);
  if (!groom_notes.empty()) text += "\nGroom\n";
  for (const std::string& note : groom_notes) text += fmt::format("  {}\n", note);
  text += "\nPasses\n" + to_text(measured.passes);
  text += fmt::format("\nMemory: {} allocated, {} saved\n", size_text(kept_bytes(measured.passes)),
                      size_text(saved_bytes(measured.passes)));
  return text;
}

}  // namespace strandcast
