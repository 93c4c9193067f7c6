#include "server/app/server.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "common/base/thread_name.h"
#include "common/base/version.h"
#include "common/base/worker_pool.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "server/app/codec_choice.h"
#include "server/app/frame_stages.h"
#include "server/app/live_desk.h"
#include "server/app/process_metrics.h"
#include "server/app/server_metrics.h"
#include "server/app/server_passes.h"
#include "server/app/session_desk.h"
#include "server/app/slow_motion.h"
#include "server/app/viewer_codec.h"
#include "server/encode/picture_passes.h"

namespace strandcast {
namespace {

constexpr auto kStatusInterval = std::chrono::milliseconds(500);

Result<EncodedFramePtr> encode_asset(const SceneAsset& asset) {
  FrameHeader header;
  header.opcode = Opcode::Asset;
  header.sequence = 1;
  EncodedFramePtr frame = make_encoded_frame(header, encode_scene_asset(asset));
  if (frame == nullptr)
    return make_error(ErrorCode::LimitExceeded, "the scene does not fit into one message of {} bytes",
                      kMaxMediaPayloadBytes);
  return frame;
}

}  // namespace

Result<std::unique_ptr<StateSource>> simulation_source(const ServerConfig& config, InputHub& inputs) {
  return make_simulation({config.scene,
                          {config.sim_device, config.gl_device, config.shader_folder},
                          config.on_publish,
                          config.tap,
                          nullptr,
                          config.is_lockstep},
                         inputs);
}

class Server::State {
 public:
  explicit State(const ServerConfig& config) : config_(config) {}
  ~State() { stop(); }

  Status start();
  void stop();
  void wait();
  ServerCounters counters() const;
  gl::PassReports passes() const;
  uint16_t port() const { return net_->port(); }
  StreamHub& hub() { return *hub_; }
  std::optional<Error> failure() const { return source_->failure(); }
  Status reload_tls() { return net_->reload_tls(); }
  Status set_tokens(std::vector<AccessToken> tokens) { return net_->set_tokens(std::move(tokens)); }
  bool is_shut_down_wanted() const { return desk_->is_shut_down_wanted(); }

 private:
  Status choose_stream(const SceneAsset& asset);
  Status choose_codecs();
  void count_strands(ServerCounters& counters) const;
  Status open_live();
  Status connect(EncodedFramePtr asset_frame);
  void begin_recording(EncodedFramePtr asset_frame);
  void run_status();
  void watch_speed(const ServerCounters& now);
  std::string metrics() const;
  gl::PassReports idle_picture_passes() const;

  ServerConfig config_;
  bool is_drawn_by_processors_ = true;  // pictures, whatever simulates
  InputHub inputs_;
  std::unique_ptr<Recorder> recorder_;  // null: nothing is recorded
  FrameStages stages_;
  std::vector<StrandCodecInfo> codecs_;  // that strands are served by, the scene's first
  // In the order in which each is used by those below it.
  std::unique_ptr<StreamHub> hub_;
  std::optional<StageSink> stage_sink_;
  std::unique_ptr<StateSource> source_;
  std::unique_ptr<LiveDesk> live_;  // null where the scene asks for none
  std::unique_ptr<SessionDesk> desk_;
  std::unique_ptr<NetServer> net_;

  mutable std::mutex idle_passes_mutex_;  // guards the two below
  mutable LookDesc idle_look_;
  mutable gl::PassReports idle_picture_passes_;  // what the frame thread would run for that look

  std::mutex mutex_;  // guards has_stopped_
  std::condition_variable changed_;
  bool has_stopped_ = false;
  std::thread status_thread_;
  // Of the status thread, but for the two that metrics read.
  SlowMotionWatch slow_watch_;
  std::string slow_motion_;  // what viewers are told; empty = real time
  std::atomic<bool> is_slow_{false};
  std::atomic<uint64_t> slow_motions_{0};
};

Status Server::State::start() {
  shared_workers();  // no nicer than this thread, as the one that draws is
  SceneDesc& scene = config_.scene;
  // What is measured here is no reason for other numbers, and inputs are for simulated times.
  if (config_.is_lockstep) scene.stream.has_codec = true;
  if (config_.is_lockstep) inputs_.hold_samples();
  // A wrong codec, or a file that cannot be written, is told before anything is loaded.
  RETURN_IF_ERROR(make_strand_encoder(scene.stream.codec));
  RETURN_IF_ERROR(check_live(scene.live));
  if (config_.record) {
    ASSIGN_OR_RETURN(recorder_, Recorder::make(*config_.record));
    config_.tap = recorder_.get();
  }
  ASSIGN_OR_RETURN(source_, config_.make_source(config_, inputs_));
  const std::shared_ptr<const SceneAsset> asset = source_->asset();
  RETURN_IF_ERROR(choose_stream(*asset));
  RETURN_IF_ERROR(choose_codecs());
  ASSIGN_OR_RETURN(EncodedFramePtr asset_frame, encode_asset(*asset));
  const PainterConfig painter{
      {config_.renderer, config_.gl_device, config_.shader_folder}, asset, scene.look};
  ASSIGN_OR_RETURN(hub_, StreamHub::make({scene.stream,
                                          codecs_.size() > 1 ? codecs_.back().name : std::string(),
                                          scene.step_rate_hz,
                                          make_scene_view(scene, scene_picture_size(scene), 0),
                                          asset,
                                          config_.make_painter(painter),
                                          {scene.look, scene.camera}}));
  is_drawn_by_processors_ = config_.is_drawn_by_processors(painter.device);
  ASSIGN_OR_RETURN(idle_picture_passes_,
                   plan_picture_passes(*asset, scene.look, likely_renderer(config_.renderer, scene.look), 0));
  idle_look_ = scene.look;
  // The port first: a port in use is told at once, not after compiling shaders.
  RETURN_IF_ERROR(open_live());
  RETURN_IF_ERROR(connect(asset_frame));
  if (recorder_ != nullptr) RETURN_IF_ERROR(recorder_->attach(*hub_));
  stages_.set_source_times([this](int64_t arrival_ns) { return inputs_.source_time_ns(arrival_ns); });
  if (!config_.trace_path.empty()) RETURN_IF_ERROR(stages_.open_trace(config_.trace_path));
  stage_sink_.emplace(*hub_, stages_);
  RETURN_IF_ERROR(source_->start(*stage_sink_, scene.stream));
  if (recorder_ != nullptr) begin_recording(std::move(asset_frame));
  hub_->set_picture_budget(is_drawn_by_processors_ ? kSoftwareBudget : kHardwareBudget);
  hub_->set_source([source = source_.get()](const SourceDemand& demand) { source->set_demand(demand); });
  net_->start();
  if (live_ != nullptr) live_->start();
  status_thread_ = std::thread([this] { run_status(); });
  log_info("app", "serving scene '{}' on {} port {}", scene.name, config_.net.address, net_->port());
  return {};
}

/// The codec of a scene that names none.
Status Server::State::choose_stream(const SceneAsset& asset) {
  StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(const CodecChoice choice, choose_codec(config_.scene, asset));
  if (choice.codec != stream.codec)
    log_warn("app", "{}", choice.reason);
  else
    log_info("app", "{}", choice.reason);
  stream.codec = choice.codec;
  stream.has_codec = true;
  return {};
}

/// What strands are served by.
Status Server::State::choose_codecs() {
  const StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(StrandCodecInfo codec, strand_codec_info(stream.codec));
  if (config_.fallback_codec) codec.fallback = *config_.fallback_codec;
  ASSIGN_OR_RETURN(codecs_, served_codecs(codec, stream.bound_m));
  if (codecs_.size() > 1)
    log_info("app", "strands by {}, and by {} for viewers that cannot decode that", codecs_[0].name,
             codecs_[1].name);
  return {};
}

/// The sockets of live motion capture, where any is asked for.
Status Server::State::open_live() {
  if (config_.scene.live.empty()) return {};
  StreamHub* hub = hub_.get();
  const LiveDesk::Listener listener{[hub](uint64_t id, const MotionSamples& samples, int64_t arrival_ns) {
                                      hub->tell_motion(id, samples, arrival_ns);
                                    },
                                    [hub](uint64_t id, const WindSamples& samples, int64_t arrival_ns) {
                                      hub->tell_wind(id, samples, arrival_ns);
                                    }};
  ASSIGN_OR_RETURN(live_, LiveDesk::open(config_.scene.live, config_.live_allowed, inputs_, listener));
  return {};
}

Status Server::State::connect(EncodedFramePtr asset_frame) {
  desk_ = std::make_unique<SessionDesk>(SessionDesk::Parts{config_.scene, *hub_, *source_, inputs_, stages_,
                                                           codecs_, std::move(asset_frame),
                                                           is_drawn_by_processors_, live_.get()});
  desk_->set_metrics([this] { return metrics(); });
  NetConfig net = config_.net;
  net.page = built_in_page();
  net.strand_classes = hub_->strand_classes();
  net.strand_codecs.clear();
  for (const StrandCodecInfo& codec : codecs_) net.strand_codecs.push_back(codec.bytes);
  ASSIGN_OR_RETURN(net_, NetServer::listen(net, *desk_));
  desk_->connect(*net_);
  return {};
}

/// What the file says first.
void Server::State::begin_recording(EncodedFramePtr asset_frame) {
  const SimStats simulated = source_->stats();
  RecordingStart start;
  start.server_version = version();
  start.sim_device = simulated.sim_device;
  start.sim_device_name = simulated.sim_device_name;
  SceneDesc scene = with_absolute_paths(config_.scene);
  start.scene_text = to_line(scene);
  recorder_->begin(std::move(start), std::move(asset_frame));
}

void Server::State::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(has_stopped_, true)) return;
  }
  changed_.notify_all();
  if (status_thread_.joinable()) status_thread_.join();
  // Viewers first, so that they hear of it; then whoever feeds the next in line.
  if (net_ != nullptr) net_->stop();
  if (live_ != nullptr) live_->stop();
  if (source_ != nullptr) source_->stop();
  if (hub_ != nullptr) hub_->stop();
  if (recorder_ != nullptr) recorder_->stop();
}

void Server::State::wait() {
  std::unique_lock lock(mutex_);
  while (!has_stopped_ && !is_shut_down_wanted() && !failure()) changed_.wait_for(lock, kStatusInterval);
}

void Server::State::run_status() {
  name_thread("status");
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kStatusInterval, [this] { return has_stopped_; })) {
    lock.unlock();
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
    status.quarantined_strands = now.sim.quarantined;
    status.overstretched_strands = now.sim.overstretched;
    status.slow_motion = slow_motion_;
    if (now.sim.detail != DetailLevel::Full)
      status.detail = fmt::format("{}: {}", to_string(now.sim.detail), now.sim.detail_reason);
    status.picture_motions = hub_->take_picture_motions();
    status.live_inputs = now.live_inputs;
    if (recorder_ != nullptr) recorder_->add(status);
    net_->broadcast(status);
    desk_->tell_state_times();
    lock.lock();
  }
}

void Server::State::watch_speed(const ServerCounters& now) {
  if (now.sim.substeps == 0) return;
  const auto change = slow_watch_.update(now.sim.realtime_factor, now.sim.is_paused, now_ns());
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
}

ServerCounters Server::State::counters() const {
  ServerCounters counters;
  counters.is_slow = is_slow_;
  counters.slow_motions = slow_motions_;
  counters.net = net_->counters();
  const RuntimeFacts facts = hub_->total().facts;
  counters.strand_viewers = facts.strand_viewers;
  counters.frame_viewers = facts.frame_viewers;
  counters.viewers = desk_->viewer_count();
  counters.input = inputs_.counters();
  counters.sim = source_->stats();
  count_strands(counters);
  counters.frames = hub_->frame_counters();
  if (live_ != nullptr) counters.live_inputs = live_->status();
  if (recorder_ != nullptr) counters.record = recorder_->counters();
  return counters;
}

void Server::State::count_strands(ServerCounters& counters) const {
  for (const StrandCodecInfo& codec : codecs_) counters.strand_viewers_of[codec.name] = 0;
  counters.strand_streams = hub_->encode_counters();
  for (const auto& [stream_id, of_stream] : counters.strand_streams) {
    const StrandStream stream = strand_stream_of(stream_id);
    const uint32_t readers = hub_->strand_readers(stream_id);
    counters.strand_viewers_of[codecs_[stream.codec].name] += readers;
    counters.strand_classes_in_use += readers > 0 ? 1 : 0;
    if (stream.strand_class > 0) continue;
    StrandEncodeCounters& first = counters.encode;
    first.encodes += of_stream.encodes;
    first.keyframes += of_stream.keyframes;
    first.too_large += of_stream.too_large;
    first.delta_bytes += of_stream.delta_bytes;
    first.keyframe_bytes += of_stream.keyframe_bytes;
    first.encode_median_ms = std::max(first.encode_median_ms, of_stream.encode_median_ms);
    first.keyframe_median_ms = std::max(first.keyframe_median_ms, of_stream.keyframe_median_ms);
  }
}

gl::PassReports Server::State::passes() const {
  ThreadPasses threads{source_->stats().passes, hub_->strand_passes(), hub_->picture_passes()};
  const bool is_drawing = !threads.pictures.empty();
  if (!is_drawing) threads.pictures = idle_picture_passes();
  return join_passes(std::move(threads), is_drawing);
}

gl::PassReports Server::State::idle_picture_passes() const {
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

std::string Server::State::metrics() const {
  return format_server_metrics(counters(), version()) + format_process_metrics() + stages_.metrics() +
         format_passes(passes(), gl::object_counts());
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerConfig& config) {
  auto state = std::make_unique<State>(config);
  RETURN_IF_ERROR(state->start());
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

StreamHub& Server::hub() {
  return state_->hub();
}
uint16_t Server::port() const {
  return state_->port();
}
ServerCounters Server::counters() const {
  return state_->counters();
}
gl::PassReports Server::passes() const {
  return state_->passes();
}
Status Server::reload_tls() {
  return state_->reload_tls();
}
Status Server::set_tokens(std::vector<AccessToken> tokens) {
  return state_->set_tokens(std::move(tokens));
}
bool Server::is_shut_down_wanted() const {
  return state_->is_shut_down_wanted();
}
std::optional<Error> Server::failure() const {
  return state_->failure();
}
void Server::stop() {
  state_->stop();
}
void Server::wait() {
  state_->wait();
}

}  // namespace strandcast
