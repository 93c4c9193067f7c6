#include <algorithm>

#include "common/wire/messages.h"
#include "common/wire/wire_private.h"
#include "strandcast/v1/session.pb.h"

namespace strandcast {
namespace {

// ---- domain to protobuf ----

void put(const Welcome& welcome, v1::ServerMessage& message) {
  v1::Welcome& out = *message.mutable_welcome();
  out.set_session_id(welcome.session_id);
  out.set_server_version(printable(welcome.server_version, kMaxNameChars));
  out.set_scene_name(printable(welcome.scene_name, kMaxNameChars));
  out.set_mode(static_cast<v1::StreamMode>(welcome.mode));
  out.set_mode_reason(printable(welcome.mode_reason, kMaxTextChars));
  out.set_codec(welcome.codec);
  out.set_strand_count(welcome.strand_count);
  out.set_vertex_count(welcome.vertex_count);
  out.set_bound_m(welcome.bound_m);
  out.set_step_rate_hz(welcome.step_rate_hz);
  put(welcome.look, *out.mutable_look());
  put(welcome.camera, *out.mutable_camera());
  out.set_frame_width(welcome.frame_width);
  out.set_frame_height(welcome.frame_height);
  out.set_role(static_cast<v1::Role>(welcome.role));
}

void put(const Pong& pong, v1::ServerMessage& message) {
  v1::Pong& out = *message.mutable_pong();
  out.set_client_time_ns(pong.client_time_ns);
  out.set_server_receive_ns(pong.server_receive_ns);
  out.set_server_send_ns(pong.server_send_ns);
}

void put(const ServerStatus& status, v1::ServerMessage& message) {
  v1::ServerStatus& out = *message.mutable_status();
  out.set_tick(status.tick);
  out.set_sim_ms(status.sim_ms);
  out.set_encode_ms(status.encode_ms);
  out.set_render_ms(status.render_ms);
  out.set_realtime_factor(status.realtime_factor);
  out.set_is_paused(status.is_paused);
  out.set_is_motion_stale(status.is_motion_stale);
  out.set_viewer_count(status.viewer_count);
  out.set_dropped_frames(status.dropped_frames);
  out.set_rejected_samples(status.rejected_samples);
  out.set_queue_delay_ms(status.queue_delay_ms);
  out.set_quarantined_strands(status.quarantined_strands);
  out.set_overstretched_strands(status.overstretched_strands);
}

void put(const Goodbye& goodbye, v1::ServerMessage& message) {
  message.mutable_goodbye()->set_reason(printable(goodbye.reason, kMaxTextChars));
}

void put(const Notice& notice, v1::ServerMessage& message) {
  message.mutable_notice()->set_is_error(notice.is_error);
  message.mutable_notice()->set_text(printable(notice.text, kMaxTextChars));
}

void put(const StreamQuality& quality, v1::ServerMessage& message) {
  v1::StreamQuality& out = *message.mutable_quality();
  out.set_stream_id(quality.stream_id);
  out.set_rate_divisor(quality.rate_divisor);
  out.set_strand_share(quality.strand_share);
  out.set_bound_m(quality.bound_m);
  out.set_reason(printable(quality.reason, kMaxTextChars));
}

void put(const SessionList& list, v1::ServerMessage& message) {
  v1::SessionList& out = *message.mutable_sessions();
  for (const SessionInfo& session : list.sessions) {
    v1::SessionInfo& item = *out.add_sessions();
    item.set_id(session.id);
    item.set_name(printable(session.name, kMaxListedNameChars));
    item.set_address(printable(session.address, kMaxAddressChars));
    item.set_role(static_cast<v1::Role>(session.role));
    item.set_mode(static_cast<v1::StreamMode>(session.mode));
    item.set_sent_bytes(session.sent_bytes);
    item.set_queue_delay_ms(session.queue_delay_ms);
    item.set_connected_s(session.connected_s);
  }
}

void put(const ModeChange& change, v1::ServerMessage& message) {
  v1::ModeChange& out = *message.mutable_mode_change();
  out.set_mode(static_cast<v1::StreamMode>(change.mode));
  out.set_reason(printable(change.reason, kMaxTextChars));
  out.set_frame_width(change.frame_width);
  out.set_frame_height(change.frame_height);
}

void put(const FrameQuality& quality, v1::ServerMessage& message) {
  v1::FrameQuality& out = *message.mutable_frame_quality();
  out.set_stream_id(quality.stream_id);
  out.set_width(quality.width);
  out.set_height(quality.height);
  out.set_rate_hz(quality.rate_hz);
  out.set_quality(quality.quality);
  out.set_codec(static_cast<v1::PictureCodec>(quality.codec));
  out.set_reason(printable(quality.reason, kMaxTextChars));
}

// ---- protobuf to domain ----

bool is_session_id(const std::string& text) {
  return text.size() == kSessionIdChars && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

Welcome take(const v1::Welcome& message, FieldCheck& check) {
  Welcome welcome;
  welcome.session_id = message.session_id();
  welcome.server_version = message.server_version();
  welcome.scene_name = message.scene_name();
  welcome.mode = check.choice("welcome.mode", message.mode(), v1::STREAM_MODE_STRANDS, StreamMode::Frames);
  welcome.mode_reason = message.mode_reason();
  welcome.codec = message.codec();
  welcome.strand_count = message.strand_count();
  welcome.vertex_count = message.vertex_count();
  welcome.bound_m = message.bound_m();
  welcome.step_rate_hz = message.step_rate_hz();
  welcome.look = take_look(message.look(), check);
  welcome.camera = take_camera(message.camera(), check);
  welcome.frame_width = message.frame_width();
  welcome.frame_height = message.frame_height();
  welcome.role = check.choice("welcome.role", message.role(), v1::ROLE_VIEWER, Role::Admin);

  if (!is_session_id(welcome.session_id))
    check.fail("welcome.session_id",
               make_error(ErrorCode::BadInput, "is not {} hexadecimal digits", kSessionIdChars));
  check.text("welcome.server_version", welcome.server_version, kMaxNameChars);
  check.text("welcome.scene_name", welcome.scene_name, kMaxNameChars);
  check.text("welcome.mode_reason", welcome.mode_reason, kMaxTextChars);
  check.text("welcome.codec", welcome.codec, kMaxNameChars);
  check.number("welcome.strand_count", welcome.strand_count, scene_fields::kStrandCount);
  check.number("welcome.vertex_count", welcome.vertex_count, scene_fields::kVertexCount);
  check.number("welcome.bound_m", welcome.bound_m, scene_fields::kStreamBound);
  check.number("welcome.step_rate_hz", welcome.step_rate_hz, scene_fields::kStepRate);
  check.frame_side("welcome.frame_width", welcome.frame_width, scene_fields::kFrameWidth);
  check.frame_side("welcome.frame_height", welcome.frame_height, scene_fields::kFrameHeight);
  return welcome;
}

Pong take(const v1::Pong& message) {
  return {message.client_time_ns(), message.server_receive_ns(), message.server_send_ns()};
}

ServerStatus take(const v1::ServerStatus& message, FieldCheck& check) {
  ServerStatus status;
  status.tick = message.tick();
  status.sim_ms = message.sim_ms();
  status.encode_ms = message.encode_ms();
  status.render_ms = message.render_ms();
  status.realtime_factor = message.realtime_factor();
  status.is_paused = message.is_paused();
  status.is_motion_stale = message.is_motion_stale();
  status.viewer_count = message.viewer_count();
  status.dropped_frames = message.dropped_frames();
  status.rejected_samples = message.rejected_samples();
  status.quarantined_strands = message.quarantined_strands();
  status.overstretched_strands = message.overstretched_strands();
  status.queue_delay_ms = message.queue_delay_ms();
  check.measure("status.queue_delay_ms", status.queue_delay_ms);
  check.measure("status.sim_ms", status.sim_ms);
  check.measure("status.encode_ms", status.encode_ms);
  check.measure("status.render_ms", status.render_ms);
  check.measure("status.realtime_factor", status.realtime_factor);
  return status;
}

Goodbye take(const v1::Goodbye& message, FieldCheck& check) {
  check.text("goodbye.reason", message.reason(), kMaxTextChars);
  return {message.reason()};
}

Notice take(const v1::Notice& message, FieldCheck& check) {
  check.text("notice.text", message.text(), kMaxTextChars);
  return {message.is_error(), message.text()};
}

StreamQuality take(const v1::StreamQuality& message, FieldCheck& check) {
  constexpr scene_fields::Range kShare{1e-6, 1.0, ""};
  constexpr scene_fields::Range kDivisor{1.0, kMaxRateDivisor, "steps"};
  check.count("quality.stream_id", message.stream_id(), UINT16_MAX);
  check.number("quality.rate_divisor", message.rate_divisor(), kDivisor);
  check.number("quality.strand_share", message.strand_share(), kShare);
  check.number("quality.bound_m", message.bound_m(), scene_fields::kStreamBound);
  check.text("quality.reason", message.reason(), kMaxTextChars);
  return {static_cast<uint16_t>(message.stream_id()), message.rate_divisor(), message.strand_share(),
          message.bound_m(), message.reason()};
}

SessionList take(const v1::SessionList& message, FieldCheck& check) {
  SessionList list;
  check.count("sessions", static_cast<size_t>(message.sessions_size()), kMaxListedSessions);
  if (!check.status()) return list;
  for (const v1::SessionInfo& item : message.sessions()) {
    SessionInfo& session = list.sessions.emplace_back();
    session.id = item.id();
    session.name = item.name();
    session.address = item.address();
    session.role = check.choice("sessions.role", item.role(), v1::ROLE_VIEWER, Role::Admin);
    session.mode = check.choice("sessions.mode", item.mode(), v1::STREAM_MODE_STRANDS, StreamMode::Auto);
    session.sent_bytes = item.sent_bytes();
    session.queue_delay_ms = item.queue_delay_ms();
    session.connected_s = item.connected_s();
    check.text("sessions.name", session.name, kMaxListedNameChars);
    check.text("sessions.address", session.address, kMaxAddressChars);
    check.measure("sessions.queue_delay_ms", session.queue_delay_ms);
    check.measure("sessions.connected_s", session.connected_s);
  }
  return list;
}

ModeChange take(const v1::ModeChange& message, FieldCheck& check) {
  check.text("mode_change.reason", message.reason(), kMaxTextChars);
  check.frame_side("mode_change.frame_width", message.frame_width(), scene_fields::kFrameWidth);
  check.frame_side("mode_change.frame_height", message.frame_height(), scene_fields::kFrameHeight);
  return {check.choice("mode_change.mode", message.mode(), v1::STREAM_MODE_STRANDS, StreamMode::Frames),
          message.reason(), message.frame_width(), message.frame_height()};
}

FrameQuality take(const v1::FrameQuality& message, FieldCheck& check) {
  FrameQuality quality;
  check.count("frame_quality.stream_id", message.stream_id(), UINT16_MAX);
  check.number("frame_quality.width", message.width(), scene_fields::kFrameWidth);
  check.number("frame_quality.height", message.height(), scene_fields::kFrameHeight);
  check.number("frame_quality.rate_hz", message.rate_hz(), scene_fields::kFrameRate);
  check.number("frame_quality.quality", message.quality(), scene_fields::kJpegQuality);
  check.text("frame_quality.reason", message.reason(), kMaxTextChars);
  quality.stream_id = static_cast<uint16_t>(message.stream_id());
  quality.width = message.width();
  quality.height = message.height();
  quality.rate_hz = message.rate_hz();
  quality.quality = message.quality();
  quality.codec =
      check.choice("frame_quality.codec", message.codec(), v1::PICTURE_CODEC_JPEG, PictureCodec::H264);
  quality.reason = message.reason();
  return quality;
}

Result<ServerMessage> take(const v1::ServerMessage& message) {
  FieldCheck check;
  ServerMessage result;
  switch (message.kind_case()) {
    case v1::ServerMessage::kWelcome:
      result = take(message.welcome(), check);
      break;
    case v1::ServerMessage::kPong:
      result = take(message.pong());
      break;
    case v1::ServerMessage::kStatus:
      result = take(message.status(), check);
      break;
    case v1::ServerMessage::kGoodbye:
      result = take(message.goodbye(), check);
      break;
    case v1::ServerMessage::kNotice:
      result = take(message.notice(), check);
      break;
    case v1::ServerMessage::kQuality:
      result = take(message.quality(), check);
      break;
    case v1::ServerMessage::kSessions:
      result = take(message.sessions(), check);
      break;
    case v1::ServerMessage::kModeChange:
      result = take(message.mode_change(), check);
      break;
    case v1::ServerMessage::kFrameQuality:
      result = take(message.frame_quality(), check);
      break;
    case v1::ServerMessage::KIND_NOT_SET:
      return make_error(ErrorCode::BadInput, "server message is of no kind that protocol {} knows",
                        kWebSocketProtocol);
  }
  RETURN_IF_ERROR(check.status());
  return result;
}

}  // namespace

std::vector<std::byte> encode(const ServerMessage& message) {
  v1::ServerMessage out;
  std::visit([&](const auto& kind) { put(kind, out); }, message);
  return pack_control(out);
}

Result<ServerMessage> decode_server_message(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  RETURN_IF_ERROR(parse_control(bytes, message));
  return take(message);
}

const char* to_string(StreamMode mode) {
  switch (mode) {
    case StreamMode::Strands:
      return "strands";
    case StreamMode::Frames:
      return "frames";
    case StreamMode::Auto:
      return "auto";
  }
  return "unknown";
}

const char* to_string(DrawingDevice device) {
  switch (device) {
    case DrawingDevice::Unknown:
      return "unknown";
    case DrawingDevice::None:
      return "none";
    case DrawingDevice::Software:
      return "software";
    case DrawingDevice::Hardware:
      return "hardware";
  }
  return "unknown";
}

const char* to_string(Role role) {
  switch (role) {
    case Role::Viewer:
      return "viewer";
    case Role::Controller:
      return "controller";
    case Role::Source:
      return "source";
    case Role::Admin:
      return "admin";
  }
  return "unknown";
}

}  // namespace strandcast
