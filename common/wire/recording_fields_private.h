// The list of the fields of all messages in recordings (message_fields_private.h says how to add one).
// Private to common/wire.
#pragma once

#include "common/wire/message_fields_private.h"
#include "common/wire/recording_messages.h"

namespace strandcast::wire_fields {

template <class Visitor>
void visit(Visitor& v, RecordingStart& m) {
  v.value("version", m.version);
  v.text("server_version", m.server_version, kMaxNameChars);
  v.exact_text("sim_device", m.sim_device, kMaxNameChars);
  v.text("sim_device_name", m.sim_device_name, kMaxTextChars);
  v.exact_text("codec", m.codec, kMaxNameChars);
  v.exact_text("scene_text", m.scene_text, kMaxRecordedSceneBytes);
  v.value("server_time_ns", m.server_time_ns);
  v.value("unix_time_ns", m.unix_time_ns);
  v.value("asset_hash", m.asset_hash);
  v.text("slate", m.slate, kMaxSlateChars);
  v.number("take", m.take, Range{0, kMaxTake, ""});
}

template <class Visitor>
void visit(Visitor& v, RecordedMotion& m) {
  v.value("source", m.source);
  v.value("arrival_ns", m.arrival_ns);
  v.group("samples", [&] { visit(v, m.samples); });
}

template <class Visitor>
void visit(Visitor& v, RecordedWind& m) {
  v.value("source", m.source);
  v.value("arrival_ns", m.arrival_ns);
  v.group("samples", [&] { visit(v, m.samples); });
}

template <class Visitor>
void visit(Visitor& v, RecordedStep& m) {
  v.value("tick", m.tick);
  v.value("time_ns", m.time_ns);
  v.value("input_rate", m.input_rate);
  v.value("position_x_m", m.world_from_head.position_m.x);
  v.value("position_y_m", m.world_from_head.position_m.y);
  v.value("position_z_m", m.world_from_head.position_m.z);
  v.value("rotation_w", m.world_from_head.rotation.w);
  v.value("rotation_x", m.world_from_head.rotation.x);
  v.value("rotation_y", m.world_from_head.rotation.y);
  v.value("rotation_z", m.world_from_head.rotation.z);
  v.names("joint_names", m.joints.name, kMaxMotionJoints, kMaxJointNameBytes);
  v.places("joint_m", m.joints.place_m, kMaxMotionJoints);
  v.require("joint_m", m.joints.name.size() == m.joints.place_m.size(), "does not go with the names");
  v.value("wind_x_mps", m.wind_mps.x);
  v.value("wind_y_mps", m.wind_mps.y);
  v.value("wind_z_mps", m.wind_mps.z);
  v.value("has_motion", m.has_motion);
  v.value("has_wind_stream", m.has_wind_stream);
  v.value("is_motion_stale", m.is_motion_stale);
  v.value("has_teleported", m.has_teleported);
  v.value("motion_speed", m.motion_speed);
  v.value("motion_time_ns", m.motion_time_ns);
  v.value("rejected_samples", m.rejected_samples);
  v.timecode("timecode", m.timecode);
}

template <class Visitor>
void visit(Visitor& v, RecordedChange& m) {
  v.value("tick", m.tick);
  v.text("who", m.who, kMaxTextChars);
  v.group("answer", [&] { visit(v, m.answer); });
  v.one_of("what", m.what);
}

template <class Visitor>
void visit(Visitor& v, RecordedStream& m) {
  v.value("tick", m.tick);
  v.exact_text("codec", m.codec, kMaxNameChars);
  v.number("bound_m", m.bound_m, scene_fields::kStreamBound);
}

template <class Visitor>
void visit(Visitor& v, RecordedHandOver& m) {
  v.value("tick", m.tick);
  v.value("frame_tick", m.frame_tick);
  v.value("frame_sequence", m.frame_sequence);
}

template <class Visitor>
void visit(Visitor& v, RecordedState& m) {
  v.value("tick", m.tick);
  v.value("sim_time_ns", m.sim_time_ns);
  v.value("state_hash", m.state_hash);
  v.timecode("timecode", m.timecode);
}

template <class Visitor>
void visit(Visitor& v, RecordedCamera& m) {
  v.value("viewer", m.viewer);
  v.group("camera", [&] { scene_fields::visit_camera(v, m.camera); });
}

template <class Visitor>
void visit(Visitor& v, RecordedLoss& m) {
  v.value("frames", m.frames);
  v.value("messages", m.messages);
  v.value("bytes", m.bytes);
}

}  // namespace strandcast::wire_fields
