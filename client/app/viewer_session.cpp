#include "client/app/viewer_session.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "common/log/log.h"

namespace strandcast {
namespace {

constexpr size_t kBytesPerPixel = 4;

/// Whether every pixel has the colour of the first.
bool is_blank(const Image& image) {
  for (size_t i = kBytesPerPixel; i < image.rgba.size(); ++i)
    if (image.rgba[i] != image.rgba[i % kBytesPerPixel]) return false;
  return true;
}

}  // namespace

SessionTotals& SessionTotals::operator+=(const SessionTotals& other) {
  using Totals = SessionTotals;
  for (const auto field :
       {&Totals::decoded_frames, &Totals::received_frames, &Totals::received_bytes, &Totals::keyframes,
        &Totals::gaps, &Totals::missed_frames, &Totals::rejected_frames, &Totals::keyframe_requests,
        &Totals::dropped_by_client, &Totals::dropped_by_server, &Totals::blank_pictures,
        &Totals::whole_pictures, &Totals::mode_changes, &Totals::look_changes, &Totals::quality_changes,
        &Totals::motion_samples})
    this->*field += other.*field;
  return *this;
}

SessionTotals totals_of(ViewerSession& session) {
  const ReplayStats& strands = session.replay().stats();
  const PictureStats& pictures = session.picture_stats();
  SessionTotals totals;
  totals.decoded_frames = session.decoded_frames();
  totals.received_frames = pictures.received_frames + strands.received_frames;
  totals.received_bytes = pictures.received_bytes + strands.received_bytes;
  totals.keyframes = strands.keyframes;
  totals.gaps = strands.gaps;
  totals.missed_frames = pictures.missed_frames + strands.missed_frames;
  totals.rejected_frames = pictures.rejected_frames + strands.rejected_frames;
  totals.keyframe_requests = strands.keyframe_requests;
  totals.dropped_by_client = session.client().counters().dropped_frames;
  totals.dropped_by_server = session.status().dropped_frames;
  totals.blank_pictures = session.blank_pictures();
  totals.whole_pictures = pictures.whole_frames;
  totals.mode_changes = session.mode_changes();
  totals.look_changes = session.look_changes();
  totals.quality_changes = session.quality_changes();
  totals.motion_samples = session.motion_latency_timer().count();
  return totals;
}

Result<std::unique_ptr<ViewerSession>> ViewerSession::open(const ClientConfig& config) {
  ClientConfig acknowledging = config;
  acknowledging.hello.acknowledges = !config.keeps_all_strands;
  if (acknowledging.hello.picture_codecs == 0)
    acknowledging.hello.picture_codecs = decodable_picture_codecs();
  ASSIGN_OR_RETURN(auto client, ViewerClient::connect(acknowledging));
  std::unique_ptr<ViewerSession> session(new ViewerSession(std::move(client)));
  session->acknowledges_ = acknowledging.hello.acknowledges;
  ViewerClient* requester = session->client_.get();
  const Welcome& welcome = session->welcome();
  auto replay = StrandReplay::make(welcome.codec, {welcome.strand_count, welcome.vertex_count},
                                   [requester] { requester->request_keyframe(); });
  // Of a later version: it will say the same again.
  if (!replay)
    return at(config.address.to_string(), Error(ErrorCode::Unsupported, replay.error().to_string()));
  session->replay_ = std::move(replay).value();
  log_info("replay", "strands by {}", codec_text(welcome));
  session->opened_ns_ = now_ns();
  session->look_ = {welcome.look, welcome.camera};
  session->quality_.bound_m = session->welcome().bound_m;
  session->asked_mode_ = config.hello.mode;
  session->follow(std::make_shared<ModeControl>(config.hello.mode));
  return session;
}

ViewerSession::ViewerSession(std::shared_ptr<ViewerClient> client)
    : client_(std::move(client)), welcome_(client_->welcome()) {}

Status ViewerSession::pump(std::chrono::milliseconds timeout) {
  send_mode_request(*modes_, *client_);
  ask_for_states();
  std::optional<int64_t> end_ns;
  while (auto event = client_->next(timeout)) {
    if (!end_ns) end_ns = now_ns() + std::chrono::nanoseconds(kPumpSlice).count();
    RETURN_IF_ERROR(handle(*event));
    if (was_shown_ && !has_picture()) ++blank_pictures_;
    was_shown_ = was_shown_ || has_picture();
    if (now_ns() >= *end_ns) break;
    timeout = std::chrono::milliseconds(0);
  }
  return {};
}

Status ViewerSession::handle(ClientEvent& event) {
  if (const auto* media = std::get_if<MediaEvent>(&event)) return handle(*media);
  if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
  if (const auto* status = std::get_if<ServerStatus>(&event)) {
    status_ = *status;
    has_status_ = true;
    hear(heard_, status->away_s, now_ns());
    picture_latency_.add_motions(status_.picture_motions, client_->clock());
    if (!status_.slow_motion.empty()) last_slow_motion_ = status_.slow_motion;
  } else if (auto* notice = std::get_if<Notice>(&event)) {
    notices_.add(std::move(*notice));
  } else if (auto* quality = std::get_if<StreamQuality>(&event)) {
    return take_quality(std::move(*quality));
  } else if (auto* frame_quality = std::get_if<FrameQuality>(&event)) {
    take_quality(std::move(*frame_quality));
  } else if (auto* change = std::get_if<ModeChange>(&event)) {
    take_mode(std::move(*change));
  } else if (const auto* look = std::get_if<LookChange>(&event)) {
    take_look(*look);
  } else if (const auto* list = std::get_if<ParameterList>(&event)) {
    take_parameters(*list);
  } else if (auto* scene = std::get_if<SceneText>(&event)) {
    scene_ = std::move(*scene);
  } else if (const auto* camera = std::get_if<CameraChange>(&event)) {
    moved_camera_ = camera->camera;
    ++camera_moves_;
  } else if (const auto* times = std::get_if<StateTimes>(&event)) {
    if (trace_ != nullptr) trace_->note_states(times->states);
  }
  return {};
}

void ViewerSession::set_trace(std::shared_ptr<FrameTrace> trace) {
  trace_ = std::move(trace);
  if (trace_ != nullptr) trace_->begin_session();
}

/// Or to tell no more, as the trace wants it. A wish that does not go out does so with the next pump().
void ViewerSession::ask_for_states() {
  if (trace_ == nullptr || trace_->wants_states() == has_asked_states_) return;
  if (client_->send(StateTimesRequest{!has_asked_states_})) has_asked_states_ = !has_asked_states_;
}

void ViewerSession::take_look(const LookChange& look) {
  if (look == look_) return;
  look_ = look;
  ++look_changes_;
}

/// Merges listed parameters into the known ones. A list that is no change replaces them.
void ViewerSession::take_parameters(const ParameterList& list) {
  auto all = std::make_shared<std::vector<ParameterInfo>>();
  if (list.is_change && parameters_ != nullptr) *all = *parameters_;
  for (const ParameterInfo& one : list.parameters) {
    const auto known = std::find_if(all->begin(), all->end(),
                                    [&](const ParameterInfo& info) { return info.path == one.path; });
    if (known != all->end())
      *known = one;
    else if (all->size() < kMaxListedParameters)
      all->push_back(one);
  }
  parameters_ = std::move(all);
}

void ViewerSession::take_mode(ModeChange change) {
  if (log_lines_.take(now_ns())) log_info("replay", "{}", change.reason);
  modes_->note_answer(std::move(change));
}

/// A frame of this mode was decoded.
void ViewerSession::show(StreamMode mode) {
  if (!modes_->note_shown(mode)) return;
  // Each stream counts its frames by itself, and those that were not sent to us are not missing.
  image_header_.sequence = 0;
  picture_latency_.restart();
  if (mode == StreamMode::Frames) replay_->forget_sequence();
}

void ViewerSession::request_mode(StreamMode mode) {
  modes_->want(mode);
  send_mode_request(*modes_, *client_);
}

void ViewerSession::follow(std::shared_ptr<ModeControl> modes) {
  modes_ = std::move(modes);
  modes_->begin_session(asked_mode_, welcome());
}

Status ViewerSession::take_quality(StreamQuality quality) {
  quality_ = std::move(quality);
  ++quality_changes_;
  if (!quality_.codec.empty() && quality_.codec != welcome_.codec) {
    const auto rest =
        asset_ ? std::span<const glm::vec3>(asset_->rest_position_m) : std::span<const glm::vec3>();
    RETURN_IF_ERROR(replay_->follow_codec(quality_.codec, rest));
    welcome_.codec = quality_.codec;
    welcome_.codec_reason = quality_.reason;
  }
  if (!log_lines_.take(now_ns())) return {};
  log_info("replay", "{:.3g} % of the strands every {} steps within {:.3g} mm: {}",
           quality_.strand_share * 1e2, quality_.rate_divisor, quality_.bound_m * 1e3, quality_.reason);
  return {};
}

void ViewerSession::take_quality(FrameQuality quality) {
  frame_quality_ = std::move(quality);
  if (!log_lines_.take(now_ns())) return;
  log_info("replay", "pictures of {} x {} by {}, quality {}, at most {:.3g} Hz: {}", frame_quality_->width,
           frame_quality_->height, to_string(frame_quality_->codec), frame_quality_->quality,
           frame_quality_->rate_hz, frame_quality_->reason);
}

Status ViewerSession::handle(const MediaEvent& event) {
  const int64_t begin_ns = now_ns();
  switch (event.header.opcode) {
    case Opcode::Asset:
      return take_asset(event);
    case Opcode::StrandKeyframe:
    case Opcode::StrandDelta:
      if (const auto snapshot = replay_->receive(event.message, event.receive_time_ns, client_->clock())) {
        if (asset_) show(StreamMode::Strands);
        acknowledge(event, begin_ns);
        tell_times(event, snapshot.get());
        if (listener_) listener_(snapshot);
      } else if (log_lines_.take(now_ns())) {
        log_debug("replay", "frame {} not used: {}", event.header.sequence, replay_->stats().last_error);
      }
      return {};
    case Opcode::JpegFrame:
    case Opcode::JpegTiles:
    case Opcode::Vp8Frame:
    case Opcode::H264Frame:
      take_picture(event);
      return {};
    case Opcode::Control:
      break;
  }
  return make_error(ErrorCode::Internal, "a control message came as media");
}

Status ViewerSession::take_asset(const MediaEvent& event) {
  const int64_t begin_ns = now_ns();
  ASSIGN_OR_RETURN(SceneAsset asset, decode_scene_asset(event.payload()));
  const Welcome& announced = welcome();
  if (asset.strand_count != announced.strand_count || asset.vertex_count != announced.vertex_count)
    return make_error(ErrorCode::BadInput, "the asset has {} x {} vertices, the Welcome announced {} x {}",
                      asset.strand_count, asset.vertex_count, announced.strand_count, announced.vertex_count);
  replay_->set_rest_shape(asset.rest_position_m);
  asset_ = std::make_shared<const SceneAsset>(std::move(asset));
  acknowledge(event, begin_ns);
  return {};
}

void ViewerSession::take_picture(const MediaEvent& event) {
  const int64_t begin_ns = now_ns();
  ++picture_stats_.received_frames;
  picture_stats_.received_bytes += event.message.size();
  const FrameHeader& header = event.header;
  if (const Status decoded = pictures_.decode(header, event.payload()); !decoded) {
    ++picture_stats_.rejected_frames;
    if (log_lines_.take(now_ns()))
      log_debug("replay", "picture {} not used: {}", header.sequence, decoded.error().to_string());
    client_->request_keyframe();
    return;
  }
  show(StreamMode::Frames);
  if (header.base_sequence == 0) ++picture_stats_.whole_frames;
  const FrameHeader last = std::exchange(image_header_, header);
  const bool is_same_stream = last.sequence != 0 && header.stream_id == last.stream_id;
  if (is_same_stream && header.sequence > last.sequence + 1)
    picture_stats_.missed_frames += header.sequence - last.sequence - 1;
  picture_latency_.add_picture(header.sim_time_ns, now_ns(), client_->clock());
  picture_decode_timer_.add_ms(static_cast<double>(now_ns() - begin_ns) * 1e-6);
  image_ = std::make_shared<const Image>(*pictures_.image());
  if (is_blank(*image_)) ++blank_pictures_;
  ++image_count_;
  tell_times(event, nullptr);
  acknowledge(event, begin_ns);
}

/// Of a state of strands, or of a picture, which knows its simulation time alone.
void ViewerSession::tell_times(const MediaEvent& event, const Snapshot* snapshot) {
  if (trace_ == nullptr) return;
  const ClockOffset clock = client_->clock();
  FrameTimes times;
  times.mode = snapshot != nullptr ? StreamMode::Strands : StreamMode::Frames;
  times.sim_time_ns = event.header.sim_time_ns;
  times.tick = snapshot != nullptr
                   ? snapshot->tick
                   : static_cast<uint64_t>(std::llround(std::max(
                         static_cast<double>(times.sim_time_ns) * 1e-9 * welcome_.step_rate_hz, 0.0)));
  times.motion_ns = snapshot != nullptr ? snapshot->motion_time_ns : 0;
  times.sent_ns = event.header.send_time_ns;
  if (clock.has_value()) {
    times.received_ns = clock.to_server_ns(event.receive_time_ns);
    times.decoded_ns = clock.to_server_ns(now_ns());
    times.clock_error_ns = clock.error_ns();
  }
  trace_->add(times);
}

void ViewerSession::acknowledge(const MediaEvent& event, int64_t decode_begin_ns) {
  const auto decode_us = static_cast<uint32_t>((now_ns() - decode_begin_ns) / 1000);
  if (!acknowledges_) return;
  // An acknowledgement that does not fit is not needed: the server drops frames for this client already.
  const auto sent = client_->send(
      FrameAck{event.header.sequence, event.receive_time_ns, decode_us, event.header.stream_id});
  if (!sent) log_debug("net", "acknowledgement not sent: {}", sent.error().to_string());
}

bool ViewerSession::has_picture() const {
  if (mode() == StreamMode::Frames) return image_ != nullptr;
  return asset_ != nullptr && replay_->newest() != nullptr;
}

uint64_t ViewerSession::decoded_frames() const {
  return image_count_ + replay_->stats().decoded_frames;
}

double ViewerSession::connected_s() const {
  return static_cast<double>(now_ns() - opened_ns_) * 1e-9;
}

}  // namespace strandcast
