// The one list of the fields of every control message, with their limits. The writer and the reader of
// messages (messages.cpp) walk it, so that they cannot disagree. Names are those of session.proto and
// input.proto; a missing name is a broken invariant, which the first test finds. Private to common/wire.
//
// Made from the .proto files by proto/schema.py, but for motion and wind. Functions of a visitor:
//   value       a number or flag without limits
//   number      a number within a range
//   measure     a time or rate: finite, not negative
//   side        the side of a picture: 0 or within a range
//   choice      an enumerator up to a last one
//   text        text for people, which the sender shortens and cleans
//   exact_text  text that is sent unchanged, with a limit in bytes
//   secret      exact text that is never printed
//   places      points of three numbers each, without limits
//   names       distinct names, none of them empty
//   timecode    a frame of a rate that timecode counts, or none
//   group, repeated, require, and the parts of looks and cameras: as in common/scene/scene_fields.h
#pragma once

#include <algorithm>

#include "common/scene/scene_fields.h"
#include "common/wire/messages.h"

namespace strandcast::wire_fields {

using scene_fields::Range;

inline constexpr Range kHeldBack{0.0, 1.0, ""};
inline constexpr int kBehindNone = 1;  // number of the first enumerator where 0 stands for none on the wire

/// Name of a kind of message: its field in ClientMessage or ServerMessage.
template <class Message>
inline constexpr const char* kKind = nullptr;

static_assert(kSessionIdChars == 16, "as the sentence below says");
inline bool is_session_id(const std::string& text) {
  return text.size() == kSessionIdChars && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}
/// Returns whether the text is one, or empty: of a client that is no relay.
inline bool is_relay_id(const std::string& text) {
  return text.empty() || is_session_id(text);
}

template <class Visitor>
void visit(Visitor& v, MotionSamples& m) {
  v.repeated("samples", m.samples, kMaxSamplesPerMessage, [&](MotionSamples::Sample& sample) {
    v.value("time_ns", sample.time_ns);
    v.value("position_x_m", sample.world_from_head.position_m.x);
    v.value("position_y_m", sample.world_from_head.position_m.y);
    v.value("position_z_m", sample.world_from_head.position_m.z);
    v.value("rotation_w", sample.world_from_head.rotation.w);
    v.value("rotation_x", sample.world_from_head.rotation.x);
    v.value("rotation_y", sample.world_from_head.rotation.y);
    v.value("rotation_z", sample.world_from_head.rotation.z);
    v.places("joint_m", sample.joint_m, kMaxMotionJoints);
  });
  v.number("held_back", m.held_back, kHeldBack);
  v.names("joint_names", m.joint_names, kMaxMotionJoints, kMaxJointNameBytes);
  v.timecode("timecode", m.timecode);
}

template <class Visitor>
void visit(Visitor& v, WindSamples& m) {
  v.repeated("samples", m.samples, kMaxSamplesPerMessage, [&](WindSamples::Sample& sample) {
    v.value("time_ns", sample.time_ns);
    v.value("velocity_x_mps", sample.velocity_mps.x);
    v.value("velocity_y_mps", sample.velocity_mps.y);
    v.value("velocity_z_mps", sample.velocity_mps.z);
  });
}

// schema begin: message fields
// clang-format off
template <>
inline constexpr const char* kKind<Hello> = "hello";
template <class Visitor>
void visit(Visitor& v, Hello& m) {
  v.choice("role", m.role, Role::Admin);
  v.choice("mode", m.mode, StreamMode::Auto);
  v.text("name", m.name, kMaxNameChars);
  v.secret("token", m.token, kMaxTokenBytes);
  v.side("frame_width", m.frame_width, scene_fields::kFrameWidth);
  v.side("frame_height", m.frame_height, scene_fields::kFrameHeight);
  v.value("acknowledges", m.acknowledges);
  v.value("picture_codecs", m.picture_codecs);
  v.value("gets_no_stream", m.gets_no_stream);
  v.number("step_ns", m.step_ns, Range{0, kMaxStepNs, "ns"});
  v.exact_text("codec_wish", m.codec_wish, kMaxNameChars);
  v.value("keeps_camera", m.keeps_camera);
  v.exact_text("head", m.head, kMaxNameChars);
  v.exact_text("relay_id", m.relay_id, kSessionIdChars);
  v.require("relay_id", is_relay_id(m.relay_id), "is not 16 hexadecimal digits");
  v.number("strand_class", m.strand_class, Range{0, kMaxListedClasses - 1, ""});
  v.value("asset_layout", m.asset_layout);
}
template <>
inline constexpr const char* kKind<MotionSamples> = "motion";
template <>
inline constexpr const char* kKind<WindSamples> = "wind";
template <>
inline constexpr const char* kKind<CameraChange> = "camera";
template <class Visitor>
void visit(Visitor& v, CameraChange& m) {
  v.group("camera", [&] { scene_fields::visit_camera(v, m.camera); });
}
template <>
inline constexpr const char* kKind<KeyframeRequest> = "keyframe_request";
template <class Visitor>
void visit(Visitor&, KeyframeRequest&) {
}
template <>
inline constexpr const char* kKind<FrameAck> = "frame_ack";
template <class Visitor>
void visit(Visitor& v, FrameAck& m) {
  v.value("sequence", m.sequence);
  v.value("receive_time_ns", m.receive_time_ns);
  v.value("decode_us", m.decode_us);
  v.number("stream_id", m.stream_id, Range{0, 65535, ""});
}
template <>
inline constexpr const char* kKind<Ping> = "ping";
template <class Visitor>
void visit(Visitor& v, Ping& m) {
  v.value("client_time_ns", m.client_time_ns);
}
template <>
inline constexpr const char* kKind<ControlCommand> = "command";
template <class Visitor>
void visit(Visitor& v, ControlCommand& m) {
  v.choice("command", m.command, Command::Reset, kBehindNone);
  v.number("step_count", m.step_count, Range{0, kMaxStepCount, "steps"});
}
template <>
inline constexpr const char* kKind<SetParameter> = "set_parameter";
template <class Visitor>
void visit(Visitor& v, SetParameter& m) {
  v.exact_text("assignment", m.assignment, kMaxAssignmentBytes);
}
template <>
inline constexpr const char* kKind<AdminCommand> = "admin";
template <class Visitor>
void visit(Visitor& v, AdminCommand& m) {
  v.choice("action", m.action, AdminAction::ShutDown, kBehindNone);
  v.value("session", m.session);
  v.number("ban_s", m.ban_s, Range{0, kMaxBanS, "s"});
}
template <>
inline constexpr const char* kKind<ViewerReport> = "viewer_report";
template <class Visitor>
void visit(Visitor& v, ViewerReport& m) {
  v.number("decode_ms", m.decode_ms, Range{0, kMaxReportedMs, "ms"});
  v.number("draw_ms", m.draw_ms, Range{0, kMaxReportedMs, "ms"});
  v.number("picture_decode_ms", m.picture_decode_ms, Range{0, kMaxReportedMs, "ms"});
  v.number("shown_hz", m.shown_hz, Range{0, kMaxReportedHz, "Hz"});
  v.choice("device", m.device, DrawingDevice::Hardware);
  v.number("hair_px", m.hair_px, Range{0, kMaxReportedPx, "pixels"});
  v.number("step_ns", m.step_ns, Range{0, kMaxStepNs, "ns"});
  v.value("wrong_states", m.wrong_states);
}
template <>
inline constexpr const char* kKind<ModeRequest> = "mode_request";
template <class Visitor>
void visit(Visitor& v, ModeRequest& m) {
  v.choice("mode", m.mode, StreamMode::Auto);
}
template <>
inline constexpr const char* kKind<SceneRequest> = "scene_request";
template <class Visitor>
void visit(Visitor&, SceneRequest&) {
}
template <>
inline constexpr const char* kKind<LiveCommand> = "live_command";
template <class Visitor>
void visit(Visitor& v, LiveCommand& m) {
  v.choice("action", m.action, LiveAction::Reset, kBehindNone);
  v.text("subject", m.subject, kMaxNameChars);
}
template <>
inline constexpr const char* kKind<ParameterRequest> = "parameter_request";
template <class Visitor>
void visit(Visitor& v, ParameterRequest& m) {
  v.exact_text("prefix", m.prefix, kMaxParameterPathBytes);
  v.number("first", m.first, Range{0, 100000, ""});
  v.value("is_watching", m.is_watching);
}
template <>
inline constexpr const char* kKind<CameraCommand> = "camera_command";
template <class Visitor>
void visit(Visitor& v, CameraCommand& m) {
  v.value("session", m.session);
  v.group("camera", [&] { scene_fields::visit_camera(v, m.camera); });
}
template <>
inline constexpr const char* kKind<StateTimesRequest> = "state_times_request";
template <class Visitor>
void visit(Visitor& v, StateTimesRequest& m) {
  v.value("is_wanted", m.is_wanted);
}
template <>
inline constexpr const char* kKind<RecordCommand> = "record_command";
template <class Visitor>
void visit(Visitor& v, RecordCommand& m) {
  v.value("is_wanted", m.is_wanted);
  v.text("name", m.name, kMaxNameChars);
  v.text("slate", m.slate, kMaxSlateChars);
  v.number("take", m.take, Range{0, kMaxTake, ""});
}
template <>
inline constexpr const char* kKind<WindowChange> = "window";
template <class Visitor>
void visit(Visitor& v, WindowChange& m) {
  v.side("frame_width", m.frame_width, scene_fields::kFrameWidth);
  v.side("frame_height", m.frame_height, scene_fields::kFrameHeight);
  v.value("is_hidden", m.is_hidden);
}
template <>
inline constexpr const char* kKind<Welcome> = "welcome";
template <class Visitor>
void visit(Visitor& v, Welcome& m) {
  v.exact_text("session_id", m.session_id, kSessionIdChars);
  v.require("session_id", is_session_id(m.session_id), "is not 16 hexadecimal digits");
  v.text("server_version", m.server_version, kMaxNameChars);
  v.text("scene_name", m.scene_name, kMaxNameChars);
  v.choice("mode", m.mode, StreamMode::Frames);
  v.text("mode_reason", m.mode_reason, kMaxTextChars);
  v.exact_text("codec", m.codec, kMaxNameChars);
  v.text("codec_reason", m.codec_reason, kMaxTextChars);
  v.number("strand_count", m.strand_count, scene_fields::kStrandCount);
  v.number("vertex_count", m.vertex_count, scene_fields::kVertexCount);
  v.number("bound_m", m.bound_m, scene_fields::kStreamBound);
  v.number("step_rate_hz", m.step_rate_hz, scene_fields::kStepRate);
  v.group("look", [&] { scene_fields::visit_look(v, m.look); });
  v.group("camera", [&] { scene_fields::visit_camera(v, m.camera); });
  v.side("frame_width", m.frame_width, scene_fields::kFrameWidth);
  v.side("frame_height", m.frame_height, scene_fields::kFrameHeight);
  v.text("sim_device", m.sim_device, kMaxTextChars);
  v.choice("role", m.role, Role::Admin);
  v.names("heads", m.heads, kMaxHeads, kMaxNameChars);
  v.names("relays", m.relays, kMaxRelays, kSessionIdChars);
}
template <>
inline constexpr const char* kKind<Pong> = "pong";
template <class Visitor>
void visit(Visitor& v, Pong& m) {
  v.value("client_time_ns", m.client_time_ns);
  v.value("server_receive_ns", m.server_receive_ns);
  v.value("server_send_ns", m.server_send_ns);
}
template <>
inline constexpr const char* kKind<ServerStatus> = "status";
template <class Visitor>
void visit(Visitor& v, ServerStatus& m) {
  v.value("tick", m.tick);
  v.measure("sim_ms", m.sim_ms);
  v.measure("encode_ms", m.encode_ms);
  v.measure("render_ms", m.render_ms);
  v.measure("realtime_factor", m.realtime_factor);
  v.value("is_paused", m.is_paused);
  v.value("is_motion_stale", m.is_motion_stale);
  v.value("viewer_count", m.viewer_count);
  v.value("dropped_frames", m.dropped_frames);
  v.value("rejected_samples", m.rejected_samples);
  v.measure("queue_delay_ms", m.queue_delay_ms);
  v.value("quarantined_strands", m.quarantined_strands);
  v.value("overstretched_strands", m.overstretched_strands);
  v.text("slow_motion", m.slow_motion, kMaxTextChars);
  v.repeated("picture_motions", m.picture_motions, kMaxPictureMotions, [&](PictureMotion& one) {
    v.value("sim_time_ns", one.sim_time_ns);
    v.value("motion_time_ns", one.motion_time_ns);
  });
  v.text("detail", m.detail, kMaxTextChars);
  v.repeated("live_inputs", m.live_inputs, kMaxLiveInputs, [&](LiveInputStatus& one) {
    v.text("input", one.input, kMaxLiveInputChars);
    v.text("sender", one.sender, kMaxAddressChars);
    v.text("subject", one.subject, kMaxNameChars);
    v.text("subjects", one.subjects, kMaxLiveSubjectsChars);
    v.value("is_stale", one.is_stale);
    v.value("is_calibrated", one.is_calibrated);
    v.measure("rate_hz", one.rate_hz);
    v.measure("jitter_ms", one.jitter_ms);
    v.measure("age_ms", one.age_ms);
    v.value("packets", one.packets);
    v.value("received_bytes", one.received_bytes);
    v.value("malformed", one.malformed);
    v.value("refused", one.refused);
    v.value("over_rate", one.over_rate);
    v.value("impossible", one.impossible);
    v.value("clamped", one.clamped);
    v.value("gated", one.gated);
    v.value("resequenced", one.resequenced);
    v.value("late", one.late);
    v.value("lost", one.lost);
    v.repeated("values", one.values, kMaxLiveValues, [&](LiveValue& part) {
      v.text("text", part.text, kMaxLiveValueChars);
    });
  });
  v.text("recording", m.recording, kMaxTextChars);
  v.timecode("timecode", m.timecode);
  v.measure("away_s", m.away_s);
}
template <>
inline constexpr const char* kKind<Goodbye> = "goodbye";
template <class Visitor>
void visit(Visitor& v, Goodbye& m) {
  v.text("reason", m.reason, kMaxTextChars);
}
template <>
inline constexpr const char* kKind<Notice> = "notice";
template <class Visitor>
void visit(Visitor& v, Notice& m) {
  v.value("is_error", m.is_error);
  v.text("text", m.text, kMaxTextChars);
  v.value("tick", m.tick);
  v.value("state_hash", m.state_hash);
}
template <>
inline constexpr const char* kKind<StreamQuality> = "quality";
template <class Visitor>
void visit(Visitor& v, StreamQuality& m) {
  v.number("stream_id", m.stream_id, Range{0, 65535, ""});
  v.number("rate_divisor", m.rate_divisor, Range{1, kMaxRateDivisor, "steps"});
  v.number("strand_share", m.strand_share, Range{1e-6, 1, ""});
  v.number("bound_m", m.bound_m, scene_fields::kStreamBound);
  v.text("reason", m.reason, kMaxTextChars);
  v.exact_text("codec", m.codec, kMaxNameChars);
}
template <>
inline constexpr const char* kKind<FrameQuality> = "frame_quality";
template <class Visitor>
void visit(Visitor& v, FrameQuality& m) {
  v.number("stream_id", m.stream_id, Range{0, 65535, ""});
  v.number("width", m.width, scene_fields::kFrameWidth);
  v.number("height", m.height, scene_fields::kFrameHeight);
  v.number("rate_hz", m.rate_hz, scene_fields::kFrameRate);
  v.number("quality", m.quality, scene_fields::kJpegQuality);
  v.choice("codec", m.codec, PictureCodec::H264);
  v.text("reason", m.reason, kMaxTextChars);
}
template <>
inline constexpr const char* kKind<SessionList> = "sessions";
template <class Visitor>
void visit(Visitor& v, SessionList& m) {
  v.repeated("sessions", m.sessions, kMaxListedSessions, [&](SessionInfo& one) {
    v.value("id", one.id);
    v.text("name", one.name, kMaxListedNameChars);
    v.text("address", one.address, kMaxAddressChars);
    v.choice("role", one.role, Role::Admin);
    v.choice("mode", one.mode, StreamMode::Auto);
    v.value("sent_bytes", one.sent_bytes);
    v.measure("queue_delay_ms", one.queue_delay_ms);
    v.measure("connected_s", one.connected_s);
  });
}
template <>
inline constexpr const char* kKind<ModeChange> = "mode_change";
template <class Visitor>
void visit(Visitor& v, ModeChange& m) {
  v.choice("mode", m.mode, StreamMode::Frames);
  v.text("reason", m.reason, kMaxTextChars);
  v.side("frame_width", m.frame_width, scene_fields::kFrameWidth);
  v.side("frame_height", m.frame_height, scene_fields::kFrameHeight);
}
template <>
inline constexpr const char* kKind<LookChange> = "look_change";
template <class Visitor>
void visit(Visitor& v, LookChange& m) {
  v.group("look", [&] { scene_fields::visit_look(v, m.look); });
  v.group("camera", [&] { scene_fields::visit_camera(v, m.camera); });
}
template <>
inline constexpr const char* kKind<SceneText> = "scene_text";
template <class Visitor>
void visit(Visitor& v, SceneText& m) {
  v.exact_text("text", m.text, kMaxSceneTextBytes);
}
template <>
inline constexpr const char* kKind<ParameterList> = "parameter_list";
template <class Visitor>
void visit(Visitor& v, ParameterList& m) {
  v.repeated("parameters", m.parameters, kMaxListedParameters, [&](ParameterInfo& one) {
    v.exact_text("path", one.path, kMaxParameterPathBytes);
    v.exact_text("value", one.value, kMaxParameterTextBytes);
    v.exact_text("unset_value", one.unset_value, kMaxParameterTextBytes);
    v.exact_text("unit", one.unit, kMaxNameChars);
    v.value("has_range", one.has_range);
    v.value("minimum", one.minimum);
    v.value("maximum", one.maximum);
    v.value("is_live", one.is_live);
    v.exact_text("note", one.note, kMaxParameterTextBytes);
  });
  v.number("total", m.total, Range{0, 100000, ""});
  v.value("is_change", m.is_change);
}
template <>
inline constexpr const char* kKind<StateTimes> = "state_times";
template <class Visitor>
void visit(Visitor& v, StateTimes& m) {
  v.repeated("states", m.states, kMaxStateTimes, [&](StateTime& one) {
    v.value("tick", one.tick);
    v.value("sim_time_ns", one.sim_time_ns);
    v.value("source_ns", one.source_ns);
    v.value("motion_ns", one.motion_ns);
    v.value("published_ns", one.published_ns);
    v.value("encoded_ns", one.encoded_ns);
    v.timecode("timecode", one.timecode);
  });
}
template <>
inline constexpr const char* kKind<StreamList> = "stream_list";
template <class Visitor>
void visit(Visitor& v, StreamList& m) {
  v.repeated("classes", m.classes, kMaxListedClasses, [&](StreamList::Class& one) {
    v.number("rate_divisor", one.rate_divisor, Range{1, kMaxRateDivisor, "steps"});
    v.number("strand_share", one.strand_share, Range{1e-6, 1, ""});
    v.number("coarsening", one.coarsening, Range{1, 1024, ""});
    v.number("bound_m", one.bound_m, scene_fields::kStreamBound);
    v.number("frame_rate_hz", one.frame_rate_hz, Range{0, 10000, "Hz"});
  });
  v.names("codecs", m.codecs, kMaxListedCodecs, kMaxNameChars);
  v.text("reason", m.reason, kMaxTextChars);
  v.exact_text("solver", m.solver, kMaxNameChars);
  v.number("solver_cost", m.solver_cost, Range{0, kMaxSolverCost, ""});
  v.number("substeps", m.substeps, scene_fields::kSubsteps);
}
// clang-format on
// schema end

}  // namespace strandcast::wire_fields
