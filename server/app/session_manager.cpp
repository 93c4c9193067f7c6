#include "server/app/session_manager.h"

#include <algorithm>
#include <random>
#include <utility>

#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/base/version.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "server/app/joined_answers.h"

namespace strandcast {
namespace {

constexpr size_t kMaxLoggedCharacters = 200;
/// A source that has not stepped for so long is not ready; the rarest step takes 0.1 s.
constexpr double kMaxReadyStepAgeS = 2.0;

const char* name_of(Command command) {
  constexpr const char* kNames[] = {"pause", "resume", "step once", "reset"};
  return kNames[static_cast<size_t>(command)];
}

const char* name_of(LiveAction action) {
  constexpr const char* kNames[] = {"subject", "calibrate", "reset"};
  return kNames[static_cast<size_t>(action)];
}

SimulatedModel model_of(const SimStats& stats) {
  return {stats.solver_name, stats.step_cost, std::max<uint32_t>(stats.substeps, 1), stats.is_paused,
          stats.realtime_factor};
}

}  // namespace

std::string make_start_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

Result<EncodedFramePtr> make_asset_frame(const SceneAsset& asset) {
  FrameHeader header;
  header.opcode = Opcode::Asset;
  header.sequence = 1;
  EncodedFramePtr frame = make_encoded_frame(header, encode_scene_asset(asset));
  if (frame == nullptr)
    return make_error(ErrorCode::LimitExceeded, "the scene does not fit into one message of {} bytes",
                      kMaxMediaPayloadBytes);
  return frame;
}

SessionManager::SessionManager(Parts parts)
    : parts_(std::move(parts)),
      session_id_(make_start_id()),
      viewers_(parts_.scene, parts_.hub),
      codecs_({parts_.codecs, parts_.source.asset()->rest_position_m.size(), parts_.scene.step_rate_hz}),
      asset_(parts_.asset) {}

EncodedFramePtr SessionManager::asset() const {
  const std::lock_guard lock(asset_mutex_);
  return asset_;
}

/// Returns the frame of a new asset; null where none can be made: then everybody keeps the old shape.
EncodedFramePtr SessionManager::follow_shape(const SceneAsset& asset) {
  Result<EncodedFramePtr> frame = make_asset_frame(asset);
  if (!frame) {
    log_error("app", "{}", frame.error().to_string());
    return nullptr;
  }
  const std::lock_guard lock(asset_mutex_);
  asset_ = *frame;
  return asset_;
}

void SessionManager::connect(NetServer& net) {
  net_ = &net;
  announcer_.connect(net);
  list_classes(parts_.hub.strand_classes(), {});
  tell_streams();
  // It hears of changes of the stream while no session is there, too.
  (void)parts_.hub.add(*this);
}

Result<Admission> SessionManager::on_hello(const Visitor& visitor, const Hello& hello) {
  if (hello.mode == StreamMode::Frames && !visitor.subscription.is_empty())
    if (const std::optional<Error> error = parts_.hub.picture_failure())
      return make_error(ErrorCode::Unavailable, "no pictures can be drawn here: {}", error->to_string());
  const bool is_controller = hello.role == Role::Controller || hello.role == Role::Admin;
  const bool is_relay = !hello.relay_id.empty();
  if (is_relay && hello.strand_class >= parts_.hub.strand_classes().size())
    return make_error(ErrorCode::Unavailable, "There is no class {} of strands now.", hello.strand_class);
  const ViewerCodec codec = codecs_.admit(visitor.session, hello, model_of(parts_.source.stats()));
  visitor.subscription.strands.codec = codec.codec;
  if (is_relay) visitor.subscription.strands.strand_class = hello.strand_class;
  const ReaderId reader = parts_.hub.add(*this, {visitor.peer, is_controller});
  viewers_.set_scene_camera(parts_.hub.look().camera);
  const Result<Viewers::Place> place = viewers_.add(visitor.session, reader, visitor.subscription, hello);
  if (!place) {
    parts_.hub.remove(reader);
    codecs_.remove(visitor.session);
    return place.error();
  }
  viewers_.note_address(visitor.session, visitor.address);
  if (is_relay) announcer_.add(visitor.session);
  if (!parts_.heads.empty() && hello.head.empty()) whole_viewers_.insert(visitor.session);
  Admission admission;
  admission.welcome = make_welcome(*place, codec);
  if (visitor.subscription.gets(StreamMode::Strands)) admission.asset = asset();
  if (!is_relay) admission.preview = preview(codec, !hello.codec_wish.empty());
  if (const auto pictures = viewers_.pictures(visitor.session))
    tell_quality(visitor.session, *pictures, "to begin with");
  return admission;
}

/// The fewest strands, by the codec that a predicting one falls back to unless that one is wished.
std::optional<Admission::Preview> SessionManager::preview(const ViewerCodec& codec, bool is_wish) const {
  const bool predicts = parts_.codecs[codec.codec].predicts;
  const size_t simple = predicts ? codec.codec + 1 : codec.codec;
  if (predicts && (is_wish || simple >= parts_.codecs.size())) return std::nullopt;
  const std::vector<StrandClass> classes = parts_.hub.strand_classes();
  const auto fewest = std::min_element(classes.begin(), classes.end(), [](const auto& a, const auto& b) {
    return a.strand_share < b.strand_share;
  });
  return Admission::Preview{{simple, static_cast<size_t>(fewest - classes.begin())},
                            parts_.codecs[simple].name};
}

Welcome SessionManager::make_welcome(const Viewers::Place& place, const ViewerCodec& codec) const {
  const SceneDesc& scene = parts_.scene;
  const std::shared_ptr<const SceneAsset> asset = parts_.source.asset();
  Welcome welcome;
  welcome.session_id = session_id_;
  welcome.server_version = version();
  welcome.scene_name = scene.name;
  welcome.mode_reason = place.reason;
  welcome.codec = parts_.codecs[codec.codec].name;
  welcome.codec_reason = codec.reason;
  welcome.strand_count = asset->strand_count;
  welcome.vertex_count = asset->vertex_count;
  welcome.bound_m = parts_.hub.stream().bound_m;
  welcome.step_rate_hz = scene.step_rate_hz;
  const LookChange look = parts_.hub.look();
  welcome.look = look.look;
  welcome.camera = look.camera;
  welcome.frame_width = place.size.width;
  welcome.frame_height = place.size.height;
  welcome.sim_device = parts_.source.stats().sim_device_name;
  welcome.heads = parts_.heads;
  return welcome;
}

void SessionManager::on_message(SessionId session, const ClientMessage& message, int64_t arrival_ns) {
  std::visit(Overloaded{[&](const MotionSamples& samples) {
                          tell_refusal(session, parts_.inputs.push(session, samples, arrival_ns));
                          parts_.hub.tell_motion(session, samples, arrival_ns);
                        },
                        [&](const WindSamples& samples) {
                          tell_refusal(session, parts_.inputs.push(session, samples, arrival_ns));
                          parts_.hub.tell_wind(session, samples, arrival_ns);
                        },
                        [&](const ControlCommand& command) { obey(session, command); },
                        [&](const SetParameter& parameter) { obey(session, parameter); },
                        [&](const LiveCommand& command) { obey(session, command); },
                        [&](const CameraCommand& command) { obey(session, command); },
                        [&](const RecordCommand& command) { obey(session, command); },
                        [&](const SceneRequest& request) { answer(session, request); },
                        [&](const ParameterRequest& request) { answer(session, request); },
                        [&](const StateTimesRequest& request) { answer(session, request); },
                        [&](const CameraChange& camera) { move_camera(session, camera); },
                        [&](const WindowChange& window) { follow_window(session, window); },
                        [&](const ViewerReport& report) { viewers_.set_report(session, report); },
                        [&](const ModeRequest& request) { viewers_.request_mode(session, request.mode); },
                        [&](const AdminCommand&) { is_shut_down_wanted_ = true; },  // all that comes here
                        [](const auto&) {}},
             message);
}

void SessionManager::tell_refusal(SessionId session, std::string why) {
  if (!why.empty()) net_->send(session, Notice{true, std::move(why)});
}

void SessionManager::on_need(SessionId, const StreamNeed& need) {
  if (need.kind == StreamNeed::Kind::Picture)
    parts_.hub.request_whole(need.picture_class);
  else
    parts_.hub.request_keyframe(need.stream_id);
}

void SessionManager::obey(SessionId session, const ControlCommand& command) {
  // Each of these waits for the one before, and a test makes many.
  const bool is_counted = command.command == Command::StepOnce && command.step_count > 0;
  if (is_counted || may_control(session, name_of(command.command))) control(session, command);
}

/// The head that the session named, else all.
void SessionManager::control(SessionId session, const ControlCommand& command) {
  StateSource::Reply reply = reply_to(session, name_of(command.command));
  const std::string who = viewers_.describe(session);
  if (!whole_viewers_.contains(session)) return parts_.source.post(command, std::move(reply), who);
  const auto answers = std::make_shared<JoinedAnswers>(parts_.heads, std::move(reply));
  for (size_t i = 0; i < parts_.sources.size(); ++i)
    parts_.sources[i]->post(
        command, [answers, i](Notice notice) { answers->take(i, std::move(notice)); }, who);
}

void SessionManager::obey(SessionId session, const SetParameter& parameter) {
  if (!may_control(session, parameter.assignment)) return;
  if (const Status status = may_change(parameter.assignment); !status)
    net_->send(session, Notice{true, status.error().message});
  else
    parts_.source.post(parameter, reply_to(session, parameter.assignment), viewers_.describe(session));
}

/// Another shape of the hair is another asset, of which a recording has one, and pictures of several heads.
Status SessionManager::may_change(const std::string& assignment) const {
  const bool reshapes = assignment.starts_with("hair.length") || assignment.starts_with("hair.curl") ||
                        assignment.starts_with("hair=");
  if (!reshapes) return {};
  if (!parts_.heads.empty())
    return make_error(ErrorCode::Unsupported,
                      "A scene of several heads has its lengths and curls from the start: set hair in the "
                      "scene or by --set.");
  if (parts_.records != nullptr && parts_.records->counters())
    return make_error(ErrorCode::Unsupported,
                      "Length and curl stay while a recording is written: record stop ends it.");
  return {};
}

std::vector<ParameterInfo> SessionManager::listed(const SceneDesc& scene) const {
  return list_parameters(scene, parts_.quality_reason ? parts_.quality_reason() : std::string());
}

void SessionManager::answer(SessionId session, const ParameterRequest& request) {
  if (!parameter_budget_.take(session, now_ns()))
    return net_->send(session, Notice{true, "Too many requests for parameters: this one was left out."});
  const std::optional<SceneDesc> scene = parts_.source.scene();
  if (!scene) return net_->send(session, Notice{true, "What is shown here has no parameters."});
  const std::vector<ParameterInfo> parameters = listed(*scene);
  if (request.is_watching) parameter_watch_.add(session, request.prefix, parameters);
  net_->send(session, list_of(parameters, request));
}

void SessionManager::tell_parameters() {
  if (parameter_watch_.is_empty()) return;
  const std::optional<SceneDesc> scene = parts_.source.scene();
  if (!scene) return;
  for (auto& [session, list] : parameter_watch_.news(listed(*scene))) net_->send(session, std::move(list));
}

void SessionManager::answer(SessionId session, const SceneRequest&) {
  if (!may_control(session, "save the scene")) return;
  const std::optional<SceneDesc> scene = parts_.whole_scene();
  SceneText answer{scene ? to_line(*scene) : std::string()};
  if (!scene)
    net_->send(session, Notice{true, "What is shown here is no scene that could be saved."});
  else if (answer.text.size() > kMaxSceneTextBytes)
    net_->send(session,
               Notice{true, fmt::format("The scene has {} bytes as text and cannot be sent: the limit "
                                        "is {}.",
                                        answer.text.size(), kMaxSceneTextBytes)});
  else
    net_->send(session, std::move(answer));
}

void SessionManager::obey(SessionId session, const LiveCommand& command) {
  if (!may_control(session,
                   fmt::format("live motion capture: {} {}", name_of(command.action), command.subject)))
    return;
  net_->send(session, parts_.live != nullptr
                          ? parts_.live->obey(command, parts_.head)
                          : Notice{true, "This server has no live inputs: start it with --mocap PROTOCOL."});
}

void SessionManager::obey(SessionId session, const CameraCommand& command) {
  const std::string whose =
      command.session == 0 ? std::string("all") : fmt::format("session {}", command.session);
  if (!may_control(session, "camera of " + whose)) return;
  const Result<Viewers::Aimed> aimed = viewers_.aimed_at(session, command.session);
  if (!aimed) return net_->send(session, Notice{true, aimed.error().to_string()});
  for (const SessionId one : aimed->movable) {
    net_->send(one, CameraChange{command.camera});
    net_->send(one, Notice{false, fmt::format("Session {} moved your view.", session)});
  }
  const auto sessions = [](size_t count) { return fmt::format("{} viewer{}", count, count == 1 ? "" : "s"); };
  std::string said = sessions(aimed->movable.size()) +
                     (aimed->movable.size() == 1 ? " looks from there." : " look from there.");
  if (!aimed->own.empty())
    said += fmt::format(" {} {} --own-camera.", sessions(aimed->own.size()),
                        aimed->own.size() == 1 ? "was started with" : "were started with");
  net_->send(session, Notice{aimed->movable.empty(), std::move(said)});
}

void SessionManager::obey(SessionId session, const RecordCommand& command) {
  const std::string what = command.is_wanted ? "record start " + command.name : "record stop";
  if (!may_control(session, what)) return;
  if (parts_.all_records != nullptr && whole_viewers_.contains(session))
    return parts_.all_records->obey(command, reply_to(session, what));
  if (parts_.records != nullptr) return parts_.records->obey(command, reply_to(session, what));
  net_->send(session, Notice{true, std::string(kNoRecordings)});
}

void SessionManager::answer(SessionId session, const StateTimesRequest& request) {
  const std::lock_guard lock(times_mutex_);
  if (request.is_wanted)
    times_readers_.insert(session);
  else
    times_readers_.erase(session);
}

void SessionManager::tell_status(ServerStatus status) {
  if (parts_.records != nullptr) status.recording = parts_.records->text();
  if (parts_.all_records == nullptr) return net_->broadcast(std::move(status), parts_.head);
  ServerStatus whole = status;
  whole.recording = parts_.all_records->text();
  net_->tell_each(
      [this, status = std::move(status), whole = std::move(whole)](SessionId session) -> ServerMessage {
        return whole_viewers_.contains(session) ? whole : status;
      },
      parts_.head);
}

void SessionManager::tell_state_times() {
  const std::lock_guard lock(times_mutex_);
  if (times_readers_.empty()) return;
  const StateTimes times{parts_.stages.take_states(now_ns())};
  if (times.states.empty()) return;
  for (const SessionId session : times_readers_) net_->send(session, times);
}

void SessionManager::tell_streams() {
  const SimulatedModel model = model_of(parts_.source.stats());
  announcer_.change([&](StreamList& list) {
    list.codecs.clear();
    for (const StrandCodecInfo& codec : parts_.codecs) list.codecs.push_back(codec.name);
    list.solver = model.solver;
    list.solver_cost = model.solver_cost;
    list.substeps = model.substeps;
  });
}

/// Returns the reply that answers the session, logs a refusal, and tells changed parameters after a
/// success.
StateSource::Reply SessionManager::reply_to(SessionId session, const std::string& what) {
  return [this, session, who = viewers_.describe(session),
          what = one_line(what, kMaxLoggedCharacters)](Notice notice) {
    if (notice.is_error) log_info("app", "{}: {} was refused: {}", who, what, notice.text);
    const bool is_done = !notice.is_error;
    net_->send(session, std::move(notice));
    if (is_done) tell_parameters();
  };
}

/// Within the controller's budget, and on record.
bool SessionManager::may_control(SessionId session, std::string_view what) {
  if (!control_budget_.take(session, now_ns())) {
    net_->send(session, Notice{true, fmt::format("More than {:.0f} commands a second: this one was left out.",
                                                 kControlsPerS)});
    return false;
  }
  log_info("app", "{}: {}", viewers_.describe(session), one_line(what, kMaxLoggedCharacters));
  return true;
}

/// Posted behind what is being done, so that a joining session has its Welcome first.
void SessionManager::tell_quality(SessionId session, const Viewers::Pictures& pictures,
                                  const std::string& reason) {
  const PictureView& view = pictures.view;
  FrameQuality quality;
  quality.stream_id = picture_stream_id(pictures.picture_class);
  quality.width = view.size.width;
  quality.height = view.size.height;
  quality.rate_hz = parts_.scene.stream.frame_rate_hz / view.rate_divisor;
  quality.quality = static_cast<uint32_t>(view.quality);
  quality.codec = view.codec;
  quality.reason = reason;
  net_->send(session, quality);
}

bool SessionManager::on_picture_step(SessionId session, size_t step, const std::string& reason) {
  const Result<Viewers::Pictures> pictures = viewers_.set_picture_step(session, step);
  if (!pictures) return false;
  log_info("net", "session {}: pictures of {} x {}, quality {}; {}", session, pictures->view.size.width,
           pictures->view.size.height, pictures->view.quality, reason);
  tell_quality(session, *pictures, reason);
  return true;
}

void SessionManager::move_camera(SessionId session, const CameraChange& camera) {
  if (const Status status = viewers_.set_camera(session, camera.camera); !status)
    net_->send(session, Notice{true, status.error().to_string()});
  else
    parts_.hub.tell_camera(session, camera.camera);
}

/// Whose pictures have no room any more when its window is seen again may come back like anybody else.
void SessionManager::follow_window(SessionId session, const WindowChange& window) {
  const RenderSize before = viewers_.picture_size(session);
  const bool was_hidden = viewers_.is_hidden(session);
  Result<std::string> why = viewers_.set_window(session, window);
  if (!why && was_hidden && !window.is_hidden) why = viewers_.set_window(session, {});
  if (!why && was_hidden) return net_->close(session, CloseCode::TryLater, why.error().to_string());
  if (!why) return net_->send(session, Notice{true, why.error().to_string()});
  const RenderSize now = viewers_.picture_size(session);
  log_debug("net", "session {}: a window of {} x {}{}", session, now.width, now.height,
            window.is_hidden ? ", hidden" : "");
  if (now.width == before.width && now.height == before.height) return;
  if (const auto pictures = viewers_.pictures(session)) tell_quality(session, *pictures, *why);
}

/// Looks whether this session should change between strands and frames.
LinkAnswer SessionManager::on_link(SessionId session, const LinkState& link, int64_t time_ns) {
  const StreamHub& hub = parts_.hub;
  const std::vector<StrandClass> classes = hub.strand_classes();
  const size_t view_count = hub.picture_views().size() + (link.mode == StreamMode::Strands ? 1 : 0);
  const std::optional<Error> failure = hub.picture_failure();
  const ModeSources sources{.strand_classes = classes,
                            .link = link,
                            .report = viewers_.report(session),
                            .pictures = hub.frame_counters(),
                            .paint_trouble = failure ? failure->to_string() : std::string(),
                            .is_software = parts_.is_drawn_by_processors,
                            .picture_size = viewers_.picture_size(session),
                            .view_count = std::max<size_t>(view_count, 1),
                            .picture_rate_hz = parts_.scene.stream.frame_rate_hz};
  LinkAnswer answer;
  if (auto change = viewers_.consider(session, gather_mode_facts(sources), time_ns))
    answer.mode = ModeAnswer{std::move(*change), asset()};
  const double states_hz =
      link.strand_class < classes.size() ? classes[link.strand_class].frame_rate_hz : 0.0;
  answer.codec =
      codecs_.consider(session, {link, sources.report, model_of(parts_.source.stats()), states_hz}, time_ns);
  answer.is_request_waiting = viewers_.has_request(session);
  return answer;
}

void SessionManager::on_change(SessionId session, SubscriptionChange change) {
  if (change == SubscriptionChange::Strands) return viewers_.note_strand_class(session);
  viewers_.note_mode(session, now_ns());
  if (const auto pictures = viewers_.pictures(session)) tell_quality(session, *pictures, "to begin with");
}

Status SessionManager::readiness() {
  if (const std::optional<Error> error = parts_.source.failure()) return *error;
  const SimStats stats = parts_.source.stats();
  // One step or command that takes long keeps everybody waiting, also while it is paused.
  const double busy_s = static_cast<double>(stats.busy_ns) * 1e-9;
  if (stats.is_paused && busy_s >= kMaxReadyStepAgeS)
    return make_error(ErrorCode::Unavailable,
                      "The simulation has been busy with one step or command for {:.1f} s (limit {} s).",
                      busy_s, kMaxReadyStepAgeS);
  if (stats.is_paused) return {};
  if (stats.last_step_ns == 0)
    return make_error(ErrorCode::Unavailable, "The simulation has not stepped yet.");
  const double age_s = static_cast<double>(now_ns() - stats.last_step_ns) * 1e-9;
  if (age_s < kMaxReadyStepAgeS) return {};
  return make_error(ErrorCode::Unavailable, "The simulation has not stepped for {:.1f} s (limit {} s).",
                    age_s, kMaxReadyStepAgeS);
}

void SessionManager::on_left(SessionId session) {
  const std::string who = viewers_.describe(session);
  parts_.source.leave(who);
  if (whole_viewers_.erase(session) > 0)
    for (StateSource* const source : parts_.sources) source->leave(who);
  control_budget_.remove(session);
  parameter_budget_.remove(session);
  answer(session, StateTimesRequest{false});
  parameter_watch_.remove(session);
  codecs_.remove(session);
  announcer_.remove(session);
  parts_.inputs.remove_source(session);
  parts_.hub.remove(viewers_.remove(session));
}

void SessionManager::list_classes(const std::vector<StrandClass>& classes, const std::string& reason) {
  announcer_.change([&](StreamList& list) {
    list.classes = classes;
    if (classes.size() > kMaxListedClasses) list.classes.resize(kMaxListedClasses);
    list.reason = reason;
  });
}

void SessionManager::on_strands(const EncodedFramePtr& frame) {
  parts_.stages.note_encoded(frame->header.sim_time_ns, now_ns());
  net_->publish_strands(frame, parts_.head);
}
void SessionManager::on_picture(PictureClass picture_class, const PicturePtr& picture) {
  net_->publish_picture(picture_class, picture, parts_.head);
}
void SessionManager::on_picture_refused(PictureClass picture_class, const Error& error) {
  net_->send_to_class(picture_class, Notice{true, "This view cannot be drawn: " + error.to_string()},
                      parts_.head);
}
void SessionManager::on_look_refused(PictureClass picture_class, const Error& error) {
  net_->send_to_class(picture_class,
                      Notice{true, "The server's pictures keep their look, this one cannot be drawn there: " +
                                       error.to_string()},
                      parts_.head);
}
void SessionManager::on_look_change(const LookChange& look) {
  net_->broadcast(look, parts_.head);
}
void SessionManager::on_pictures_failed(const Error& error) {
  net_->broadcast(Notice{true, "No pictures can be drawn: " + error.to_string()}, parts_.head);
}
void SessionManager::on_stream_change(const std::vector<StrandClass>& classes,
                                      std::shared_ptr<void> until_told) {
  constexpr const char* kReason = "the stream was changed";
  list_classes(classes, kReason);
  net_->set_strand_classes(
      classes, kReason, [until_told] {}, parts_.head);
}

void SessionManager::on_shape_change(const std::shared_ptr<const SceneAsset>& asset,
                                     std::shared_ptr<void> until_told) {
  const EncodedFramePtr frame = follow_shape(*asset);
  if (frame != nullptr)
    net_->renew_asset(
        frame, [until_told] {}, parts_.head);
}

bool ControlBudget::take(SessionId session, int64_t time_ns) {
  Bucket& bucket = buckets_.try_emplace(session, Bucket{kControlBurst, time_ns}).first->second;
  const double passed_s = static_cast<double>(time_ns - bucket.time_ns) * kSPerNs;
  bucket.left = std::min(kControlBurst, bucket.left + passed_s * kControlsPerS);
  bucket.time_ns = time_ns;
  if (bucket.left < 1.0) return false;
  bucket.left -= 1.0;
  return true;
}

}  // namespace strandcast
