#include "server/app/server.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/base/version.h"
#include "common/groom/groom_asset.h"
#include "common/log/log.h"
#include "common/strands/scene_asset.h"
#include "server/app/control_budget.h"
#include "server/app/mode_facts.h"
#include "server/app/scene_change.h"
#include "server/app/server_metrics.h"
#include "server/app/viewers.h"

namespace strandcast {
namespace {

constexpr size_t kMaxLoggedCharacters = 200;
constexpr auto kStatusInterval = std::chrono::milliseconds(500);
/// A simulation that has not stepped for so long is not ready; the rarest step takes 0.1 s.
constexpr double kMaxReadyStepAgeS = 2.0;

const char* name_of(Command command) {
  constexpr const char* kNames[] = {"pause", "resume", "step once", "reset"};
  return kNames[static_cast<size_t>(command)];
}

std::string make_session_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

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

class Server::State : public NetHandler {
 public:
  explicit State(const ServerConfig& config)
      : config_(config), stream_(config.scene.stream), viewers_(config.scene) {}
  ~State() override { stop(); }

  Status start();
  void stop();
  void wait();
  ServerCounters counters() const;
  uint16_t port() const { return net_->port(); }
  std::optional<Error> failure() const { return sim_->failure(); }
  Status reload_tls() { return net_->reload_tls(); }
  bool is_shut_down_wanted() const { return is_shut_down_wanted_; }

  Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) override;
  void on_motion(SessionId session, const MotionSamples& samples, int64_t arrival_ns) override {
    hub_.push(session, samples, arrival_ns);
  }
  void on_wind(SessionId session, const WindSamples& samples, int64_t arrival_ns) override {
    hub_.push(session, samples, arrival_ns);
  }
  void on_command(SessionId session, const ControlCommand& command) override {
    if (may_control(session, name_of(command.command))) sim_->post(command, reply_to(session));
  }
  void on_parameter(SessionId session, const SetParameter& parameter) override {
    if (may_control(session, parameter.assignment)) sim_->post(parameter, reply_to(session));
  }
  void on_camera(SessionId session, const CameraChange& camera) override;
  void on_ack(SessionId, const FrameAck&) override {}
  void on_keyframe_request(SessionId, uint16_t stream_id) override { encoder(stream_id).request_keyframe(); }
  void on_picture_request(SessionId, PictureClass picture_class) override {
    frames_->request_whole(picture_class);
  }
  bool on_picture_step(SessionId session, size_t step, const std::string& reason) override;
  void on_strand_class(SessionId session, uint16_t stream_id) override {
    viewers_.set_strand_class(session, stream_id);
    follow_viewers();
  }
  void on_shut_down(SessionId) override { is_shut_down_wanted_ = true; }
  void on_report(SessionId session, const ViewerReport& report) override {
    viewers_.set_report(session, report);
  }
  void on_mode_request(SessionId session, const ModeRequest& request) override {
    viewers_.request_mode(session, request.mode);
  }
  void on_link(SessionId session, const LinkState& link, int64_t time_ns) override;
  void on_mode(SessionId session, StreamMode mode) override {
    viewers_.set_mode(session, mode, now_ns());
    if (const auto pictures = viewers_.pictures(session)) tell_quality(session, *pictures, "to begin with");
    follow_viewers();
  }
  void on_left(SessionId session) override;
  Status readiness() override;
  std::string metrics() override;

 private:
  void start_workers(std::unique_ptr<StrandDecoder> decoder);
  StrandEncodeWorker& encoder(uint16_t stream_id);
  std::vector<StrandClass> classes_of(const StreamDesc& stream) const;
  StrandEncodeConfig encode_config(uint16_t stream_id) const;
  void change_stream(const StreamDesc& stream);
  SimLoop::Reply reply_to(SessionId session) {
    return [this, session](Notice notice) { net_->send(session, std::move(notice)); };
  }
  bool may_control(SessionId session, std::string_view what);
  Welcome make_welcome(const Viewers::Place& place) const;
  void follow_viewers();
  void tell_quality(SessionId session, const Viewers::Pictures& pictures, const std::string& reason);
  void run_status();

  const ServerConfig config_;
  // How strands are coded now. Network thread, and before that starts.
  StreamDesc stream_;
  std::vector<StrandClass> classes_;
  const std::string session_id_ = make_session_id();
  InputHub hub_;
  SnapshotSlot slot_;
  Viewers viewers_;
  ControlBudget control_budget_;
  std::shared_ptr<const SceneContent> content_;
  std::shared_ptr<const SceneAsset> asset_;
  EncodedFramePtr asset_frame_;

  std::unique_ptr<NetServer> net_;
  mutable std::mutex
      workers_mutex_;  // guards that the two still exist, for threads that stop() does not wait for first
  std::unique_ptr<FrameWorker> frames_;
  std::vector<std::unique_ptr<StrandEncodeWorker>> encoders_;  // by stream_id; null until somebody needs it
  std::unique_ptr<SimLoop> sim_;

  std::mutex mutex_;  // guards has_stopped_
  std::condition_variable changed_;
  bool has_stopped_ = false;
  std::atomic<bool> is_shut_down_wanted_{false};
  std::thread status_thread_;
};

Status Server::State::start() {
  const SceneDesc& scene = config_.scene;
  RETURN_IF_ERROR(check_solver(scene));
  // A wrong codec is told before anything is loaded.
  RETURN_IF_ERROR(make_strand_encoder(scene.stream.codec));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  content_ = std::make_shared<const SceneContent>(std::move(content));
  asset_ = std::make_shared<const SceneAsset>(make_scene_asset(content_->groom, content_->head));
  ASSIGN_OR_RETURN(asset_frame_, encode_asset(*asset_));
  ASSIGN_OR_RETURN(auto strand_decoder,
                   make_strand_decoder(scene.stream.codec, {asset_->strand_count, asset_->vertex_count}));
  strand_decoder->set_rest_shape(asset_->rest_position_m);
  // The port first: a port in use is told at once, not after compiling shaders.
  NetConfig net = config_.net;
  classes_ = classes_of(stream_);
  net.strand_classes = classes_;
  ASSIGN_OR_RETURN(net_, NetServer::listen(net, *this));
  SimLoopConfig sim{scene,
                    content_,
                    config_.gl_device,
                    config_.shader_folder,
                    config_.on_publish,
                    [this](const StreamDesc& stream) { change_stream(stream); }};
  ASSIGN_OR_RETURN(sim_, SimLoop::start(std::move(sim), hub_, slot_));
  start_workers(std::move(strand_decoder));
  net_->start();
  status_thread_ = std::thread([this] { run_status(); });
  log_info("app", "serving scene '{}' on {} port {}", scene.name, config_.net.address, net_->port());
  return {};
}

void Server::State::start_workers(std::unique_ptr<StrandDecoder> decoder) {
  FrameWorker::Hooks hooks;
  hooks.sink = [this](uint32_t picture_class, PicturePtr picture) {
    net_->publish_picture(picture_class, std::move(picture));
  };
  hooks.request_keyframe = [this] {
    const std::lock_guard lock(workers_mutex_);
    if (!encoders_.empty() && encoders_[0] != nullptr) encoders_[0]->request_keyframe();
  };
  hooks.on_refused = [this](uint32_t picture_class, const Error& error) {
    net_->send_to_class(picture_class, Notice{true, "This view cannot be drawn: " + error.to_string()});
  };
  hooks.on_failure = [this](const Error& error) {
    log_error("render", "{}", error.to_string());
    net_->broadcast(Notice{true, "No frames can be drawn: " + error.to_string()});
  };
  const GlPainterConfig painter{config_.gl_device, config_.shader_folder, asset_, config_.scene.look};
  frames_ =
      std::make_unique<FrameWorker>(std::move(decoder), config_.make_painter(painter),
                                    FrameWorkerConfig{config_.scene.stream.frame_rate_hz}, std::move(hooks));
  (void)encoder(0);
}

/// The encoder of a class, made when it is needed first. Network thread, and before that starts.
StrandEncodeWorker& Server::State::encoder(uint16_t stream_id) {
  const std::lock_guard lock(workers_mutex_);
  encoders_.resize(std::max(classes_.size(), encoders_.size()));
  std::unique_ptr<StrandEncodeWorker>& worker = encoders_[stream_id];
  if (worker != nullptr) return *worker;
  const auto sink = [this](EncodedFramePtr frame) {
    if (frame->header.stream_id == 0) {
      const std::lock_guard sink_lock(workers_mutex_);
      if (frames_ != nullptr && frames_->has_views()) frames_->offer(frame);
    }
    net_->publish_strands(std::move(frame));
  };
  auto made = make_strand_encoder(config_.scene.stream.codec);
  CHECK(made.ok());  // start() has made one
  (*made)->set_rest_shape(asset_->rest_position_m);
  worker = std::make_unique<StrandEncodeWorker>(slot_, std::move(*made), sink, encode_config(stream_id));
  return *worker;
}

std::vector<StrandClass> Server::State::classes_of(const StreamDesc& stream) const {
  return make_strand_classes(
      {config_.scene.step_rate_hz, stream.strand_rate_hz, stream.bound_m, asset_->strand_count});
}

StrandEncodeConfig Server::State::encode_config(uint16_t stream_id) const {
  const StrandClass& row = classes_[stream_id];
  const Result<float> quantum_m = lattice_step_m(stream_.codec, stream_.bound_m);
  CHECK(quantum_m.ok());  // as above
  return {stream_id, row.rate_divisor, row.coarsening, row.strand_share, *quantum_m};
}

/// Simulation thread. States on the new lattice wait in the slot until the network thread has told everybody.
void Server::State::change_stream(const StreamDesc& stream) {
  std::vector<StrandClass> classes = classes_of(stream);
  net_->set_strand_classes(classes, "the stream was changed", [this, stream, classes] {
    stream_ = stream;
    classes_ = classes;
    const std::lock_guard lock(workers_mutex_);
    encoders_.resize(std::max(classes_.size(), encoders_.size()));
    for (uint16_t stream_id = 0; stream_id < encoders_.size(); ++stream_id)
      if (encoders_[stream_id] != nullptr && stream_id < classes_.size())
        encoders_[stream_id]->change(encode_config(stream_id));
  });
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
  slot_.stop();
  if (sim_ != nullptr) sim_->stop();
  // Each worker calls the other: both are taken out of reach before their threads are joined.
  std::vector<std::unique_ptr<StrandEncodeWorker>> encoders;
  std::unique_ptr<FrameWorker> frames;
  const auto take = [this](auto& from, auto& to) {
    const std::lock_guard lock(workers_mutex_);
    to = std::move(from);
  };
  take(encoders_, encoders);
  take(frames_, frames);
}

void Server::State::wait() {
  std::unique_lock lock(mutex_);
  while (!has_stopped_ && !is_shut_down_wanted_ && !sim_->failure()) changed_.wait_for(lock, kStatusInterval);
}

Welcome Server::State::make_welcome(const Viewers::Place& place) const {
  const SceneDesc& scene = config_.scene;
  Welcome welcome;
  welcome.session_id = session_id_;
  welcome.server_version = version();
  welcome.scene_name = scene.name;
  welcome.mode = place.mode;
  welcome.mode_reason = place.reason;
  welcome.codec = scene.stream.codec;
  welcome.strand_count = asset_->strand_count;
  welcome.vertex_count = asset_->vertex_count;
  welcome.bound_m = stream_.bound_m;
  welcome.step_rate_hz = scene.step_rate_hz;
  welcome.look = scene.look;
  welcome.camera = scene.camera;
  welcome.frame_width = place.size.width;
  welcome.frame_height = place.size.height;
  return welcome;
}

Result<Admission> Server::State::on_hello(const Visitor& visitor, const Hello& hello) {
  const SessionId session = visitor.session;
  if (hello.mode == StreamMode::Frames && hello.role != Role::Source)
    if (const std::optional<Error> error = frames_->failure())
      return make_error(ErrorCode::Unsupported, "no frames can be drawn here: {}", error->to_string());
  ASSIGN_OR_RETURN(const Viewers::Place place, viewers_.add(visitor, hello));
  Admission admission;
  admission.welcome = make_welcome(place);
  if (hello.role != Role::Source && place.mode == StreamMode::Strands) admission.asset = asset_frame_;
  admission.picture_class = place.picture_class;
  admission.picture_costs = place.picture_costs;
  admission.picture_step = place.picture_step;
  follow_viewers();
  if (const auto pictures = viewers_.pictures(session)) tell_quality(session, *pictures, "to begin with");
  return admission;
}

/// Posted behind what is being done, so that a joining session has its Welcome first.
void Server::State::tell_quality(SessionId session, const Viewers::Pictures& pictures,
                                 const std::string& reason) {
  const PictureView& view = pictures.view;
  FrameQuality quality;
  quality.stream_id = picture_stream_id(pictures.picture_class);
  quality.width = view.size.width;
  quality.height = view.size.height;
  quality.rate_hz = config_.scene.stream.frame_rate_hz / view.rate_divisor;
  quality.quality = static_cast<uint32_t>(view.quality);
  quality.codec = view.codec;
  quality.reason = reason;
  net_->send(session, quality);
}

bool Server::State::on_picture_step(SessionId session, size_t step, const std::string& reason) {
  const Result<Viewers::Pictures> pictures = viewers_.set_picture_step(session, step);
  if (!pictures) return false;
  log_info("net", "session {}: pictures of {} x {}, quality {}; {}", session, pictures->view.size.width,
           pictures->view.size.height, pictures->view.quality, reason);
  tell_quality(session, *pictures, reason);
  net_->set_picture_class(session, pictures->picture_class);
  frames_->set_views(viewers_.picture_views());
  return true;
}

void Server::State::on_camera(SessionId session, const CameraChange& camera) {
  const Result<std::optional<PictureClass>> picture_class = viewers_.set_camera(session, camera.camera);
  if (!picture_class) return net_->send(session, Notice{true, picture_class.error().to_string()});
  if (!*picture_class) return;
  net_->set_picture_class(session, **picture_class);
  frames_->set_views(viewers_.picture_views());
}

/// Looks whether this session should change between strands and frames.
void Server::State::on_link(SessionId session, const LinkState& link, int64_t time_ns) {
  const auto views = viewers_.picture_views();
  const std::optional<Error> failure = frames_->failure();
  const ModeSources sources{
      .strand_classes = classes_,
      .link = link,
      .report = viewers_.report(session),
      .pictures = frames_->counters(),
      .paint_trouble = failure ? failure->to_string() : std::string(),
      .is_software = sim_->stats().is_software,
      .picture_size = viewers_.picture_size(session),
      .view_count = std::max<size_t>(views.size() + (link.mode == StreamMode::Strands ? 1 : 0), 1),
      .picture_rate_hz = config_.scene.stream.frame_rate_hz};
  std::optional<ModeSwitch> change = viewers_.consider(session, gather_mode_facts(sources), time_ns);
  if (!change) return;
  change->asset = asset_frame_;
  net_->change_mode(session, std::move(*change));
  follow_viewers();
}

/// Within the controller's budget, and on record.
bool Server::State::may_control(SessionId session, std::string_view what) {
  if (!control_budget_.take(session, now_ns())) {
    net_->send(session, Notice{true, fmt::format("More than {:.0f} commands a second: this one was left out.",
                                                 kControlsPerS)});
    return false;
  }
  log_info("app", "{}: {}", viewers_.describe(session), one_line(what, kMaxLoggedCharacters));
  return true;
}

void Server::State::on_left(SessionId session) {
  control_budget_.remove(session);
  hub_.remove_source(session);
  viewers_.remove(session);
  follow_viewers();
}

/// What runs follows who watches.
void Server::State::follow_viewers() {
  const RuntimeFacts facts = viewers_.facts();
  frames_->set_views(viewers_.picture_views());
  for (uint16_t stream_id = 0; stream_id < encoders_.size(); ++stream_id) {
    const bool draws = stream_id == 0 && facts.frame_viewers > 0;  // pictures are drawn from the first class
    const bool is_needed = viewers_.strand_viewers(stream_id) > 0 || draws;
    if (is_needed || encoders_[stream_id] != nullptr) encoder(stream_id).set_has_listeners(is_needed);
  }
  sim_->set_facts(facts);
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
  const RuntimeFacts facts = viewers_.facts();
  counters.strand_viewers = facts.strand_viewers;
  counters.frame_viewers = facts.frame_viewers;
  counters.viewers = viewers_.viewer_count();
  counters.input = hub_.counters();
  counters.sim = sim_->stats();
  const std::lock_guard lock(workers_mutex_);
  for (const auto& worker : encoders_)
    counters.strand_classes.push_back(worker != nullptr ? worker->counters() : StrandEncodeCounters{});
  if (!counters.strand_classes.empty()) counters.encode = counters.strand_classes[0];
  if (frames_ != nullptr) counters.frames = frames_->counters();
  return counters;
}

Status Server::State::readiness() {
  if (const std::optional<Error> error = sim_->failure()) return *error;
  const SimStats stats = sim_->stats();
  if (stats.is_paused) return {};
  if (stats.last_step_ns == 0)
    return make_error(ErrorCode::Unavailable, "The simulation has not stepped yet.");
  const double age_s = static_cast<double>(now_ns() - stats.last_step_ns) * 1e-9;
  if (age_s < kMaxReadyStepAgeS) return {};
  return make_error(ErrorCode::Unavailable, "The simulation has not stepped for {:.1f} s (limit {} s).",
                    age_s, kMaxReadyStepAgeS);
}

std::string Server::State::metrics() {
  ServerCounters now = counters();
  for (uint16_t stream_id = 0; stream_id < classes_.size(); ++stream_id)
    now.strand_classes_in_use += viewers_.strand_viewers(stream_id) > 0 ? 1 : 0;
  return format_server_metrics(now, version());
}

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerConfig& config) {
  auto state = std::make_unique<State>(config);
  RETURN_IF_ERROR(state->start());
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

uint16_t Server::port() const {
  return state_->port();
}
ServerCounters Server::counters() const {
  return state_->counters();
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
