// One message of every kind with every field away from its default, for wire tests.
#pragma once

#include <vector>

#include "common/wire/messages.h"
#include "tests/support/sample_look.h"

namespace strandcast {

inline std::vector<ClientMessage> sample_client_messages() {
  MotionSamples motion;
  WindSamples wind;
  for (int i = 0; i < 5; ++i) {
    motion.samples.push_back({1'000 + i, {{0.1 * i, -2.0, 1e5}, {0.5, 0.5, -0.5, 0.5}}});
    if (i > 0)
      motion.samples.back().joint_m = {{0.25f, -0.5f, 0.125f * static_cast<float>(i)}, {1.0f, 2.0f, 3.0f}};
    wind.samples.push_back({-7 + i, {1.5f * static_cast<float>(i), -3.0f, 0.25f}});
  }
  motion.held_back = 0.75;
  motion.joint_names = {"neck", "left_shoulder"};
  motion.timecode = Timecode{{30000, 1001}, true, 107'892, 0.25};
  CameraChange camera;
  camera.camera = {{1.0f, 2.0f, -3.0f}, {0.5f, 0.25f, 0.125f}, 1.25f};
  return {Hello{Role::Controller, StreamMode::Auto, "Zoë", "secret", 640, 360, true, kAllPictureCodecs, true,
                12.5, "delta", true, "ben", "fedcba9876543210", 5, 2},
          motion,
          wind,
          camera,
          KeyframeRequest{},
          FrameAck{4'000'000'000u, -5, 1234, 65'535},
          Ping{INT64_MIN},
          ControlCommand{Command::Reset, 240},
          SetParameter{"solver.name=dftl"},
          AdminCommand{AdminAction::Kick, 1ull << 40, 600.5},
          ViewerReport{3.5, 200.0, 1.25, 4.5, DrawingDevice::Software, 180.5, 12.5, 2},
          ModeRequest{StreamMode::Auto},
          SceneRequest{},
          LiveCommand{LiveAction::Reset, "Zoë's head"},
          ParameterRequest{"look.shading", 128, true},
          CameraCommand{1ull << 40, camera.camera},
          StateTimesRequest{true},
          RecordCommand{true, "take 5", "12A", 3},
          WindowChange{1280, 720, true}};
}

inline std::vector<ServerMessage> sample_server_messages() {
  Welcome welcome;
  welcome.session_id = "0123456789abcdef";
  welcome.server_version = "0.1.0";
  welcome.scene_name = "walk";
  welcome.mode = StreamMode::Frames;
  welcome.mode_reason = "the viewer asked for frames";
  welcome.codec = "delta";
  welcome.codec_reason = "delta was asked for";
  welcome.strand_count = 2000;
  welcome.vertex_count = 16;
  welcome.bound_m = 2e-5f;
  welcome.step_rate_hz = 120.0;
  welcome.look = sample_look();
  welcome.camera = sample_camera();
  welcome.frame_width = 1280;
  welcome.frame_height = 720;
  welcome.sim_device = "lanes (AVX-512, 2 threads)";
  welcome.role = Role::Admin;
  welcome.heads = {"walk", "ben"};
  welcome.relays = {"fedcba9876543210", "0011223344556677"};
  ServerStatus status;
  status.tick = 1ull << 40;
  status.sim_ms = 2.5;
  status.encode_ms = 0.5;
  status.render_ms = 12.0;
  status.realtime_factor = 0.99;
  status.is_paused = true;
  status.is_motion_stale = false;
  status.viewer_count = 3;
  status.dropped_frames = 17;
  status.rejected_samples = 19;
  status.quarantined_strands = 23;
  status.overstretched_strands = 29;
  status.queue_delay_ms = 31.5;
  status.picture_motions = {{2'000'000'000, -5}, {INT64_MAX, INT64_MIN}};
  status.slow_motion = "half of real time; substeps=1 takes a third of the work away";
  status.detail = "half rate: the hair is 50 pixels high on the largest screen: all from 240 on";
  LiveInputStatus live;
  live.input = "vmc, port 39539";
  live.sender = "127.0.0.1:50123";
  live.subject = "Head";
  live.subjects = "Head, Hips";
  live.is_stale = true;
  live.is_calibrated = true;
  live.rate_hz = 59.5;
  live.jitter_ms = 0.75;
  live.age_ms = 12.25;
  live.packets = 1ull << 33;
  live.received_bytes = 1ull << 41;
  live.malformed = 2;
  live.refused = 3;
  live.over_rate = 4;
  live.impossible = 5;
  live.clamped = 6;
  live.gated = 7;
  live.resequenced = 8;
  live.late = 9;
  live.lost = 10;
  live.values = {{"/VMC/Ext/Bone/Pos Head 0 1.5 0"}, {"/VMC/Ext/OK 1"}};
  status.live_inputs = {live, LiveInputStatus{}};
  status.recording = "take 5.mcap: 12.5 s, 3.2 MB";
  status.timecode = Timecode{{24000, 1001}, false, 89'356, 0.5};
  status.away_s = 2.5;
  return {
      welcome,
      Pong{1, -2, INT64_MAX},
      status,
      Goodbye{"the server is shutting down"},
      Notice{true, "unknown field 'x'", 1ull << 41, (1ull << 52) + 5},
      StreamQuality{3, 4, 0.5f, 5e-4f, "a slow link", "delta"},
      ModeChange{StreamMode::Frames, "the viewer draws 3 pictures per second", 640, 360},
      SessionList{{{7, "Zoë", "2001:db8::1", Role::Controller, StreamMode::Frames, 1ull << 40, 12.5, 0.25},
                   {8, "", "127.0.0.1", Role::Admin, StreamMode::Strands, 0, 0.0, 0.0}}},
      FrameQuality{0x8003, 640, 360, 7.5, 50, PictureCodec::JpegTiles, "a slow link"},
      LookChange{sample_look(), sample_camera()},
      SceneText{"name: \"walk\" step_rate_hz: 120"},
      ParameterList{{{"look.ambient", "0.25", "0.5", "", true, 0.0, 10.0, true, "light from all around"},
                     {"stream.bound_m", "0.0001", "0.0002", "m", true, 2e-5, 5e-4, true, ""}},
                    345,
                    true},
      CameraChange{sample_camera()},
      StateTimes{{{1ull << 40, 1, 2, 3, 4, INT64_MAX, Timecode{{25, 1}, false, 2'159'999}},
                  {7, INT64_MIN, -1, -2, -3, -4}}},
      StreamList{{{1, 1.0f, 1, 1e-4f, 60.0}, {4, 0.25f, 5, 5e-4f, 15.0}},
                 {"step", "tangent"},
                 "another bound",
                 "direct_rod",
                 1.5,
                 2}};
}

}  // namespace strandcast
