// What the window's panel shows. Plain data, filled by the application for every picture.
#pragma once

#include <cstdint>
#include <string>

namespace strandcast {

struct HudState {
  std::string title;        // scene name and sizes
  std::string connection;   // "127.0.0.1:7878", or what is wrong with it
  std::string mode;         // what is shown: strands or frames, playout
  std::string mode_wish;    // what was asked for, and what became of it
  std::string mode_reason;  // why, by the server or this machine
  std::string message;      // newest notice, fades out by the application
  double fps = 0.0;
  double render_ms = 0.0;
  double decode_ms = 0.0;
  double sim_ms = 0.0;
  double encode_ms = 0.0;
  double realtime_factor = 0.0;
  double kilobytes_per_s = 0.0;
  double frames_per_s = 0.0;  // received
  double state_age_ms = 0.0;
  double motion_to_decoded_ms = 0.0;
  double playout_delay_ms = 0.0;  // smooth playout only
  double round_trip_ms = 0.0;
  double queue_delay_ms = 0.0;  // of data on its way here
  uint64_t tick = 0;
  uint64_t dropped_by_server = 0;
  uint64_t missed_frames = 0;
  uint64_t dropped_by_client = 0;
  uint32_t viewer_count = 0;
  bool is_connected = false;
  bool is_paused = false;
  bool is_motion_stale = false;
};

}  // namespace strandcast
