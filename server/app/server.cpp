#include "server/app/server.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "common/base/version.h"
#include "common/log/log.h"
#include "common/strands/scene_asset.h"
#include "server/app/server_metrics.h"
#include "server/app/server_passes.h"
#include "server/app/session_desk.h"
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
  return make_simulation({config.scene, config.gl_device, config.shader_folder, config.on_publish}, inputs);
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
  bool is_shut_down_wanted() const { return desk_->is_shut_down_wanted(); }

 private:
  Status connect(EncodedFramePtr asset_frame);
  void run_status();
  std::string metrics() const;

  const ServerConfig config_;
  InputHub inputs_;
  gl::PassReports idle_picture_passes_;  // what the frame thread would run
  // In the order in which each is used by those below it.
  std::unique_ptr<StreamHub> hub_;
  std::unique_ptr<StateSource> source_;
  std::unique_ptr<SessionDesk> desk_;
  std::unique_ptr<NetServer> net_;

  std::mutex mutex_;  // guards has_stopped_
  std::condition_variable changed_;
  bool has_stopped_ = false;
  std::thread status_thread_;
};

Status Server::State::start() {
  const SceneDesc& scene = config_.scene;
  // A wrong codec is told before anything is loaded.
  RETURN_IF_ERROR(make_strand_encoder(scene.stream.codec));
  ASSIGN_OR_RETURN(source_, config_.make_source(config_, inputs_));
  const std::shared_ptr<const SceneAsset> asset = source_->asset();
  ASSIGN_OR_RETURN(EncodedFramePtr asset_frame, encode_asset(*asset));
  const GlPainterConfig painter{config_.gl_device, config_.shader_folder, asset, scene.look};
  ASSIGN_OR_RETURN(hub_, StreamHub::make({scene.stream, scene.step_rate_hz,
                                          make_scene_view(scene, scene_picture_size(scene), 0), asset,
                                          config_.make_painter(painter)}));
  ASSIGN_OR_RETURN(idle_picture_passes_, plan_picture_passes(*asset, scene.look, true, 0));
  // The port first: a port in use is told at once, not after compiling shaders.
  RETURN_IF_ERROR(connect(std::move(asset_frame)));
  RETURN_IF_ERROR(source_->start(*hub_));
  // Pictures are drawn by the device that simulates.
  hub_->set_picture_budget(source_->stats().is_software ? kSoftwareBudget : kHardwareBudget);
  hub_->set_source([source = source_.get()](const SourceDemand& demand) { source->set_demand(demand); });
  net_->start();
  status_thread_ = std::thread([this] { run_status(); });
  log_info("app", "serving scene '{}' on {} port {}", scene.name, config_.net.address, net_->port());
  return {};
}

Status Server::State::connect(EncodedFramePtr asset_frame) {
  desk_ = std::make_unique<SessionDesk>(
      SessionDesk::Parts{config_.scene, *hub_, *source_, inputs_, std::move(asset_frame)});
  desk_->set_metrics([this] { return metrics(); });
  NetConfig net = config_.net;
  net.strand_classes = hub_->strand_classes();
  ASSIGN_OR_RETURN(net_, NetServer::listen(net, *desk_));
  desk_->connect(*net_);
  return {};
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
  if (source_ != nullptr) source_->stop();
  if (hub_ != nullptr) hub_->stop();
}

void Server::State::wait() {
  std::unique_lock lock(mutex_);
  while (!has_stopped_ && !is_shut_down_wanted() && !failure()) changed_.wait_for(lock, kStatusInterval);
}

void Server::State::run_status() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kStatusInterval, [this] { return has_stopped_; })) {
    lock.unlock();
    const ServerCounters now = counters();
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
    net_->broadcast(status);
    lock.lock();
  }
}

ServerCounters Server::State::counters() const {
  ServerCounters counters;
  counters.net = net_->counters();
  const RuntimeFacts facts = hub_->total().facts;
  counters.strand_viewers = facts.strand_viewers;
  counters.frame_viewers = facts.frame_viewers;
  counters.viewers = desk_->viewer_count();
  counters.input = inputs_.counters();
  counters.sim = source_->stats();
  counters.strand_classes = hub_->encode_counters();
  if (!counters.strand_classes.empty()) counters.encode = counters.strand_classes[0];
  counters.frames = hub_->frame_counters();
  return counters;
}

gl::PassReports Server::State::passes() const {
  ThreadPasses threads{source_->stats().passes, hub_->strand_passes(), hub_->picture_passes()};
  const bool is_drawing = !threads.pictures.empty();
  if (!is_drawing) threads.pictures = idle_picture_passes_;
  return join_passes(std::move(threads), is_drawing);
}

std::string Server::State::metrics() const {
  ServerCounters now = counters();
  for (uint16_t stream_id = 0; stream_id < hub_->strand_classes().size(); ++stream_id)
    now.strand_classes_in_use += hub_->strand_readers(stream_id) > 0 ? 1 : 0;
  return format_server_metrics(now, version()) + format_passes(passes(), gl::object_counts());
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
