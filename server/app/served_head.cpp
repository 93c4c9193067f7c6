#include "server/app/served_head.h"

#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/version.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "server/app/codec_choice.h"
#include "server/app/server_passes.h"
#include "server/app/viewer_codec.h"
#include "server/encode/picture_painter.h"

namespace strandcast {
namespace {

// Of pictures in lockstep: it tells a state's lattice, whichever states came before. Others may be off by the
// bound, and by what differs with the times at which pictures are drawn.
constexpr const char* kSteppedPictureCodec = "delta";

}  // namespace

Result<std::unique_ptr<ServedHead>> ServedHead::load(const ServerConfig& config, size_t number,
                                                     OtherHeads others) {
  std::unique_ptr<ServedHead> head(new ServedHead(config, number));
  RETURN_IF_ERROR(head->load(std::move(others)));
  return head;
}

ServedHead::~ServedHead() {
  stop();
}

Status ServedHead::load(OtherHeads others) {
  SceneDesc& scene = config_.scene;
  // What is measured here is no reason for other numbers, and inputs are for simulated times.
  if (config_.is_lockstep) scene.stream.has_codec = true;
  if (config_.is_lockstep) inputs_.hold_samples();
  // A wrong codec, or a file that cannot be written, is told before anything is loaded.
  RETURN_IF_ERROR(make_strand_encoder(scene.stream.codec));
  RETURN_IF_ERROR(check_live(scene.live));
  if (config_.record || config_.record_folder) {
    ASSIGN_OR_RETURN(records_, RecordManager::make(config_.record, config_.record_folder));
    config_.tap = records_->first_tap();
  }
  ASSIGN_OR_RETURN(sender_,
                   HeadSender::open(config_.sends, {static_cast<uint32_t>(number_), scene.step_rate_hz,
                                                    config_.clock, [this] { return told(); }}));
  // Steps by commands depend on who watches only where the recording is to be of exact frames.
  const bool is_exact = config_.record && config_.record->keyframe_s > 0.0;
  config_.shared = config_.is_lockstep && !is_exact ? nullptr : &shared_;
  ASSIGN_OR_RETURN(source_, config_.make_source(config_, inputs_));
  if (const std::optional<SceneDesc> loaded = source_->scene()) scene.camera = loaded->camera;
  const std::shared_ptr<const SceneAsset> asset = source_->asset();
  RETURN_IF_ERROR(choose_stream());
  RETURN_IF_ERROR(choose_codecs());
  ASSIGN_OR_RETURN(asset_frame_, make_asset_frame(*asset));
  painting_ = {config_.renderer, config_.gl_device, config_.shader_folder};
  const PainterConfig painter{painting_, asset, scene.look};
  ASSIGN_OR_RETURN(
      hub_, StreamHub::make({scene.stream,
                             codecs_.size() > 1 ? codecs_.back().name : std::string(),
                             scene.step_rate_hz,
                             make_scene_view(scene, scene_picture_size(scene), 0),
                             asset,
                             make_painter(painter, std::move(others)),
                             {scene.look, scene.camera},
                             &shared_,
                             [this](const auto& other, const LookDesc& look) {
                               return config_.make_painter({painting_, other, look});
                             },
                             [this](const SnapshotInfo& state) { stages_.note_state(state, now_ns()); },
                             config_.is_lockstep ? kSteppedPictureCodec : std::string()}));
  is_drawn_by_processors_ = config_.is_drawn_by_processors(painter.device);
  ASSIGN_OR_RETURN(idle_picture_passes_,
                   plan_picture_passes(*asset, scene.look, likely_renderer(config_.renderer, scene.look), 0));
  idle_look_ = scene.look;
  return {};
}

MakePicturePainter ServedHead::make_painter(const PainterConfig& painter, OtherHeads others) {
  if (!others) return config_.make_painter(painter);
  // While this head moves, its own states say when there is something to draw.
  return heads_picture_painter(painter, config_.scene.camera, std::move(others), [this] {
    if (source_->stats().is_paused) hub_->redraw();
  });
}

/// The codec of a scene that names none.
Status ServedHead::choose_stream() {
  StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(const CodecChoice choice,
                   choose_codec(config_.scene, *source_->asset(),
                                {config_.sim_device, config_.gl_device, config_.shader_folder}));
  if (choice.codec != stream.codec)
    log_warn("app", "{}", choice.reason);
  else
    log_info("app", "{}", choice.reason);
  stream.codec = choice.codec;
  stream.has_codec = true;
  return {};
}

/// What strands are served by.
Status ServedHead::choose_codecs() {
  const StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(StrandCodecInfo codec, strand_codec_info(stream.codec));
  if (config_.fallback_codec) codec.fallback = *config_.fallback_codec;
  ASSIGN_OR_RETURN(codecs_, served_codecs(codec, stream.bound_m));
  if (codecs_.size() > 1)
    log_info("app", "strands by {}, and by {} for viewers that cannot decode that", codecs_[0].name,
             codecs_[1].name);
  return {};
}

LiveManager::Target ServedHead::live_target() {
  StreamHub* hub = hub_.get();
  LiveManager::Target target;
  target.live = config_.scene.live;
  target.inputs = &inputs_;
  target.listener.on_motion = [hub](uint64_t id, const MotionSamples& samples, int64_t arrival_ns) {
    hub->tell_motion(id, samples, arrival_ns);
  };
  target.listener.on_wind = [hub](uint64_t id, const WindSamples& samples, int64_t arrival_ns) {
    hub->tell_wind(id, samples, arrival_ns);
  };
  return target;
}

NetHead ServedHead::admit(Whole whole) {
  live_ = whole.live;
  manager_ = std::make_unique<SessionManager>(SessionManager::Parts{
      config_.scene, *hub_, *source_, inputs_, stages_, codecs_, asset_frame_, is_drawn_by_processors_,
      config_.scene.live.empty() ? nullptr : live_, number_, std::move(whole.heads), std::move(whole.scene),
      [this] { return quality_reason(); }, records_.get(), whole.records, std::move(whole.sources)});
  manager_->set_metrics(std::move(whole.metrics));
  NetHead head{name(), manager_.get(), hub_->strand_classes(), {}};
  for (const StrandCodecInfo& codec : codecs_) head.strand_codecs.push_back(codec.bytes);
  return head;
}

Status ServedHead::start(NetServer& net) {
  net_ = &net;
  manager_->connect(net);
  if (records_ != nullptr)
    RETURN_IF_ERROR(records_->attach({*hub_, *source_, [this] { return describe_recording(); },
                                      [this] { return manager_->asset(); }, config_.scene.name,
                                      config_.shared != nullptr}));
  stages_.set_source_times([this](int64_t arrival_ns) { return inputs_.source_time_ns(arrival_ns); });
  if (!config_.trace_path.empty()) RETURN_IF_ERROR(stages_.open_trace(config_.trace_path));
  RETURN_IF_ERROR(source_->start(*hub_, config_.scene.stream));
  if (records_ != nullptr) records_->begin();
  hub_->set_picture_budget(is_drawn_by_processors_ ? kSoftwareBudget : kHardwareBudget);
  if (!sender_->is_empty()) {
    Demand every_state;
    every_state.has_states = true;
    RETURN_IF_ERROR(hub_->set_demand(hub_->add(*sender_), every_state));
  }
  hub_->set_source([source = source_.get()](const SourceDemand& demand) { source->set_demand(demand); });
  return {};
}

/// What a file says first.
RecordingStart ServedHead::describe_recording() const {
  const SimStats simulated = source_->stats();
  RecordingStart start;
  start.server_version = version();
  start.sim_device = simulated.sim_device;
  start.sim_device_name = simulated.sim_device_name;
  SceneDesc scene = source_->scene().value_or(config_.scene);
  scene.quality = kCustomQuality;  // as it runs, whatever machine replays it
  scene.stream.codec = config_.scene.stream.codec;
  scene.stream.has_codec = true;
  start.scene_text = to_line(with_absolute_paths(std::move(scene)));
  return start;
}

void ServedHead::stop() {
  if (source_ != nullptr) source_->stop();
  if (hub_ != nullptr) hub_->stop();
  if (records_ != nullptr) records_->stop();
}

void ServedHead::tell_status() {
  count_by_the_clock();
  const ServerCounters now = counters();
  watch_speed(now);
  ServerStatus status;
  status.tick = now.sim.tick;
  status.sim_ms = now.sim.step_median_ms;
  status.encode_ms = now.encode.encode_median_ms;
  status.render_ms = now.frame_viewers > 0 ? now.frames.paint_median_ms + now.frames.encode_median_ms : 0.0;
  status.realtime_factor = now.sim.realtime_factor;
  status.is_paused = now.sim.is_paused;
  status.is_motion_stale = now.sim.is_motion_stale;
  status.viewer_count = now.viewers;
  status.rejected_samples = now.input.rejected();
  status.timecode = now.sim.timecode;
  status.quarantined_strands = now.sim.quarantined;
  status.overstretched_strands = now.sim.overstretched;
  status.slow_motion = slow_motion_;
  if (now.sim.detail != DetailLevel::Full)
    status.detail = fmt::format("{}: {}", to_string(now.sim.detail), now.sim.detail_reason);
  status.picture_motions = hub_->take_picture_motions();
  status.live_inputs = now.live_inputs;
  if (records_ != nullptr) records_->add(status);
  manager_->tell_status(std::move(status));
  manager_->tell_state_times();
  manager_->tell_streams();
}

/// What who follows the head is told besides its pose.
HeadTold ServedHead::told() const {
  HeadTold told{source_->wind_mps(), {}, {}};
  if (records_ == nullptr) return told;
  const std::optional<std::string> slate = records_->slate();
  told.is_recording = slate.has_value();
  told.slate = slate.value_or("");
  return told;
}

/// Where nobody sends timecode, this machine's clock counts.
void ServedHead::count_by_the_clock() {
  if (config_.timecode) inputs_.push(config_.clock.timecode(*config_.timecode), now_ns());
}

void ServedHead::watch_speed(const ServerCounters& now) {
  if (now.sim.substeps == 0) return;
  // What a change took is no reason to simulate less: time counts anew behind it.
  const bool has_changed = now.sim.built_ns != 0 && now_ns() - now.sim.built_ns < kSlowNs;
  const auto change = slow_watch_.update(now.sim.realtime_factor, now.sim.is_paused || has_changed, now_ns());
  is_slow_ = slow_watch_.is_slow();
  if (!is_slow_) slow_motion_.clear();
  if (change == SlowMotionWatch::Change::Ended) log_info("sim", "The simulation runs in real time again.");
  if (!is_slow_) return;
  SceneDesc scene = config_.scene;
  scene.substeps = now.sim.substeps;
  scene.stream.strand_rate_hz = now.sim.strand_rate_hz;
  scene.solver.name = now.sim.solver_name;
  StepWork work = work_per_step(scene, now);
  work.vertices = source_->asset()->rest_position_m.size();
  slow_motion_ = slow_motion_text(now.sim.realtime_factor, scene, work);
  if (change != SlowMotionWatch::Change::Began) return;
  ++slow_motions_;
  log_warn("sim", "{}", slow_motion_);
  lower_quality();
}

std::string ServedHead::quality_reason() const {
  if (is_too_slow_) {
    const std::optional<SceneDesc> running = source_->scene();
    return running && running->quality == kFastQuality ? "full does not keep up with real time" : "";
  }
  return source_->stats().quality_reason;
}

/// Of a scene that leaves its quality to the machine, once: what was measured at rest was too little.
void ServedHead::lower_quality() {
  const std::optional<SceneDesc> running = source_->scene();
  if (has_lowered_quality_ || !running || running->quality != kAutoQuality) return;
  has_lowered_quality_ = true;
  if (running->solver.name == kCheapestSolver) return;
  is_too_slow_ = true;
  log_warn(
      "sim",
      "quality auto: fast from here on, as full does not keep up with real time; where fewer strands are "
      "simulated it may: strandcast-ctl set detail.simulated_share=0.5, then quality=full");
  source_->post(
      SetParameter{std::string("quality=") + kFastQuality},
      [this](const Notice&) { manager_->tell_parameters(); }, "quality auto");
}

std::optional<SceneDesc> ServedHead::scene() const {
  std::optional<SceneDesc> scene = source_->scene();
  if (scene && live_ != nullptr) scene->live = live_->live(number_);
  return scene;
}

ServerCounters ServedHead::counters() const {
  ServerCounters counters;
  counters.is_slow = is_slow_;
  counters.slow_motions = slow_motions_;
  const RuntimeFacts facts = hub_->total().facts;
  counters.strand_viewers = facts.strand_viewers;
  counters.frame_viewers = facts.frame_viewers;
  counters.viewers = manager_->viewer_count();
  counters.input = inputs_.counters();
  counters.sim = source_->stats();
  count_strands(counters);
  counters.frames = hub_->frame_counters();
  if (live_ != nullptr) counters.live_inputs = live_->status(number_);
  if (records_ != nullptr) counters.record = records_->counters();
  return counters;
}

void ServedHead::count_strands(ServerCounters& counters) const {
  for (const StrandCodecInfo& codec : codecs_) counters.strand_viewers_of[codec.name] = 0;
  counters.strand_streams = hub_->encode_counters();
  for (const auto& [stream_id, of_stream] : counters.strand_streams) {
    const StrandStream stream = strand_stream_of(stream_id);
    const uint32_t readers = hub_->strand_readers(stream_id);
    if (stream.codec < codecs_.size()) counters.strand_viewers_of[codecs_[stream.codec].name] += readers;
    counters.strand_classes_in_use += readers > 0 ? 1 : 0;
    if (stream.strand_class > 0) continue;
    StrandEncodeCounters& first = counters.encode;
    first.encodes += of_stream.encodes;
    first.keyframes += of_stream.keyframes;
    first.too_large += of_stream.too_large;
    first.delta_bytes += of_stream.delta_bytes;
    first.keyframe_bytes += of_stream.keyframe_bytes;
    first.exact += of_stream.exact;
    first.encode_median_ms = std::max(first.encode_median_ms, of_stream.encode_median_ms);
    first.keyframe_median_ms = std::max(first.keyframe_median_ms, of_stream.keyframe_median_ms);
  }
}

gl::PassReports ServedHead::passes() const {
  ThreadPasses threads{source_->stats().passes, hub_->strand_passes(), hub_->picture_passes()};
  const bool is_drawing = !threads.pictures.empty();
  if (!is_drawing) threads.pictures = idle_picture_passes();
  return join_passes(std::move(threads), is_drawing);
}

gl::PassReports ServedHead::idle_picture_passes() const {
  const LookDesc look = hub_->look().look;
  const std::lock_guard lock(idle_passes_mutex_);
  if (look != idle_look_) {
    if (auto planned =
            plan_picture_passes(*source_->asset(), look, likely_renderer(config_.renderer, look), 0))
      idle_picture_passes_ = std::move(planned).value();
    idle_look_ = look;
  }
  return idle_picture_passes_;
}

}  // namespace strandcast
