#include "common/wire/messages.h"
#include "common/wire/wire_private.h"
#include "strandcast/v1/session.pb.h"

namespace strandcast {
namespace {

// ---- domain to protobuf ----

void put(const Hello& hello, v1::ClientMessage& message) {
  v1::Hello& out = *message.mutable_hello();
  out.set_role(static_cast<v1::Role>(hello.role));
  out.set_mode(static_cast<v1::StreamMode>(hello.mode));
  out.set_name(printable(hello.name, kMaxNameChars));
  out.set_token(hello.token);
  out.set_frame_width(hello.frame_width);
  out.set_frame_height(hello.frame_height);
  out.set_acknowledges(hello.acknowledges);
  out.set_picture_codecs(hello.picture_codecs);
}

void put(const MotionSamples& motion, v1::ClientMessage& message) {
  v1::MotionSamples& out = *message.mutable_motion();
  for (const auto& sample : motion.samples) {
    v1::MotionSample& item = *out.add_samples();
    item.set_time_ns(sample.time_ns);
    item.set_position_x_m(sample.world_from_head.position_m.x);
    item.set_position_y_m(sample.world_from_head.position_m.y);
    item.set_position_z_m(sample.world_from_head.position_m.z);
    item.set_rotation_w(sample.world_from_head.rotation.w);
    item.set_rotation_x(sample.world_from_head.rotation.x);
    item.set_rotation_y(sample.world_from_head.rotation.y);
    item.set_rotation_z(sample.world_from_head.rotation.z);
  }
}

void put(const WindSamples& wind, v1::ClientMessage& message) {
  v1::WindSamples& out = *message.mutable_wind();
  for (const auto& sample : wind.samples) {
    v1::WindSample& item = *out.add_samples();
    item.set_time_ns(sample.time_ns);
    item.set_velocity_x_mps(sample.velocity_mps.x);
    item.set_velocity_y_mps(sample.velocity_mps.y);
    item.set_velocity_z_mps(sample.velocity_mps.z);
  }
}

void put(const CameraChange& change, v1::ClientMessage& message) {
  put(change.camera, *message.mutable_camera()->mutable_camera());
}

void put(const KeyframeRequest&, v1::ClientMessage& message) {
  message.mutable_keyframe_request();
}

void put(const FrameAck& ack, v1::ClientMessage& message) {
  v1::FrameAck& out = *message.mutable_frame_ack();
  out.set_sequence(ack.sequence);
  out.set_receive_time_ns(ack.receive_time_ns);
  out.set_decode_us(ack.decode_us);
  out.set_stream_id(ack.stream_id);
}

void put(const Ping& ping, v1::ClientMessage& message) {
  message.mutable_ping()->set_client_time_ns(ping.client_time_ns);
}

void put(const ControlCommand& command, v1::ClientMessage& message) {
  const int number = v1::COMMAND_PAUSE + static_cast<int>(command.command);
  message.mutable_command()->set_command(static_cast<v1::Command>(number));
}

void put(const SetParameter& parameter, v1::ClientMessage& message) {
  message.mutable_set_parameter()->set_assignment(parameter.assignment);
}

void put(const AdminCommand& command, v1::ClientMessage& message) {
  const int number = v1::ADMIN_ACTION_LIST_SESSIONS + static_cast<int>(command.action);
  message.mutable_admin()->set_action(static_cast<v1::AdminAction>(number));
  message.mutable_admin()->set_session(command.session);
}

void put(const ViewerReport& report, v1::ClientMessage& message) {
  v1::ViewerReport& out = *message.mutable_viewer_report();
  out.set_decode_ms(report.decode_ms);
  out.set_draw_ms(report.draw_ms);
  out.set_picture_decode_ms(report.picture_decode_ms);
  out.set_shown_hz(report.shown_hz);
  out.set_device(static_cast<v1::DrawingDevice>(report.device));
}

void put(const ModeRequest& request, v1::ClientMessage& message) {
  message.mutable_mode_request()->set_mode(static_cast<v1::StreamMode>(request.mode));
}

// ---- protobuf to domain ----

Hello take(const v1::Hello& message, FieldCheck& check) {
  Hello hello;
  hello.role = check.choice("hello.role", message.role(), v1::ROLE_VIEWER, Role::Admin);
  hello.mode = check.choice("hello.mode", message.mode(), v1::STREAM_MODE_STRANDS, StreamMode::Auto);
  hello.name = message.name();
  hello.token = message.token();
  hello.frame_width = message.frame_width();
  hello.frame_height = message.frame_height();
  hello.acknowledges = message.acknowledges();
  hello.picture_codecs = message.picture_codecs();  // bits that this version does not know mean nothing
  check.text("hello.name", hello.name, kMaxNameChars);
  check.count("hello.token", hello.token.size(), kMaxTokenBytes);
  check.frame_side("hello.frame_width", hello.frame_width, scene_fields::kFrameWidth);
  check.frame_side("hello.frame_height", hello.frame_height, scene_fields::kFrameHeight);
  return hello;
}

MotionSamples take(const v1::MotionSamples& message, FieldCheck& check) {
  MotionSamples motion;
  check.count("motion.samples", static_cast<size_t>(message.samples_size()), kMaxSamplesPerMessage);
  if (!check.status()) return motion;
  for (const v1::MotionSample& item : message.samples()) {
    MotionSamples::Sample& sample = motion.samples.emplace_back();
    sample.time_ns = item.time_ns();
    sample.world_from_head.position_m = {item.position_x_m(), item.position_y_m(), item.position_z_m()};
    sample.world_from_head.rotation =
        glm::dquat(item.rotation_w(), item.rotation_x(), item.rotation_y(), item.rotation_z());
  }
  return motion;
}

WindSamples take(const v1::WindSamples& message, FieldCheck& check) {
  WindSamples wind;
  check.count("wind.samples", static_cast<size_t>(message.samples_size()), kMaxSamplesPerMessage);
  if (!check.status()) return wind;
  for (const v1::WindSample& item : message.samples())
    wind.samples.push_back(
        {item.time_ns(), {item.velocity_x_mps(), item.velocity_y_mps(), item.velocity_z_mps()}});
  return wind;
}

FrameAck take(const v1::FrameAck& message, FieldCheck& check) {
  check.count("frame_ack.stream_id", message.stream_id(), UINT16_MAX);
  return {message.sequence(), message.receive_time_ns(), message.decode_us(),
          static_cast<uint16_t>(message.stream_id())};
}

ControlCommand take(const v1::ControlCommand& message, FieldCheck& check) {
  return {check.choice("command", message.command(), v1::COMMAND_PAUSE, Command::Reset)};
}

SetParameter take(const v1::SetParameter& message, FieldCheck& check) {
  check.text("set_parameter.assignment", message.assignment(), kMaxAssignmentBytes);
  check.count("set_parameter.assignment", message.assignment().size(), kMaxAssignmentBytes);
  return {message.assignment()};
}

AdminCommand take(const v1::AdminCommand& message, FieldCheck& check) {
  return {
      check.choice("admin.action", message.action(), v1::ADMIN_ACTION_LIST_SESSIONS, AdminAction::ShutDown),
      message.session()};
}

ViewerReport take(const v1::ViewerReport& message, FieldCheck& check) {
  constexpr scene_fields::Range kTime{0.0, kMaxReportedMs, "ms"};
  constexpr scene_fields::Range kRate{0.0, kMaxReportedHz, "Hz"};
  check.number("viewer_report.decode_ms", message.decode_ms(), kTime);
  check.number("viewer_report.draw_ms", message.draw_ms(), kTime);
  check.number("viewer_report.picture_decode_ms", message.picture_decode_ms(), kTime);
  check.number("viewer_report.shown_hz", message.shown_hz(), kRate);
  return {message.decode_ms(), message.draw_ms(), message.picture_decode_ms(), message.shown_hz(),
          check.choice("viewer_report.device", message.device(), v1::DRAWING_DEVICE_UNKNOWN,
                       DrawingDevice::Hardware)};
}

ModeRequest take(const v1::ModeRequest& message, FieldCheck& check) {
  return {check.choice("mode_request.mode", message.mode(), v1::STREAM_MODE_STRANDS, StreamMode::Auto)};
}

Result<ClientMessage> take(const v1::ClientMessage& message) {
  FieldCheck check;
  ClientMessage result;
  switch (message.kind_case()) {
    case v1::ClientMessage::kHello:
      result = take(message.hello(), check);
      break;
    case v1::ClientMessage::kMotion:
      result = take(message.motion(), check);
      break;
    case v1::ClientMessage::kWind:
      result = take(message.wind(), check);
      break;
    case v1::ClientMessage::kCamera:
      result = CameraChange{take_camera(message.camera().camera(), check)};
      break;
    case v1::ClientMessage::kKeyframeRequest:
      result = KeyframeRequest{};
      break;
    case v1::ClientMessage::kFrameAck:
      result = take(message.frame_ack(), check);
      break;
    case v1::ClientMessage::kPing:
      result = Ping{message.ping().client_time_ns()};
      break;
    case v1::ClientMessage::kCommand:
      result = take(message.command(), check);
      break;
    case v1::ClientMessage::kSetParameter:
      result = take(message.set_parameter(), check);
      break;
    case v1::ClientMessage::kAdmin:
      result = take(message.admin(), check);
      break;
    case v1::ClientMessage::kViewerReport:
      result = take(message.viewer_report(), check);
      break;
    case v1::ClientMessage::kModeRequest:
      result = take(message.mode_request(), check);
      break;
    case v1::ClientMessage::KIND_NOT_SET:
      return make_error(ErrorCode::BadInput, "client message is of no kind that protocol {} knows",
                        kWebSocketProtocol);
  }
  RETURN_IF_ERROR(check.status());
  return result;
}

}  // namespace

std::vector<std::byte> encode(const ClientMessage& message) {
  v1::ClientMessage out;
  std::visit([&](const auto& kind) { put(kind, out); }, message);
  return pack_control(out);
}

Result<ClientMessage> decode_client_message(std::span<const std::byte> bytes) {
  v1::ClientMessage message;
  RETURN_IF_ERROR(parse_control(bytes, message));
  return take(message);
}

}  // namespace strandcast
