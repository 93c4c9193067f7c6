// InputFrame: head motion and wind at a given time, merged from all input streams. Plain data.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "common/base/timecode.h"
#include "common/math/pose.h"
#include "common/scene/body_desc.h"

namespace strandcast {

struct InputFrame {
  Pose world_from_head;      // resampled to the asked time
  JointPlaces joints;        // of the body, at the same time; none where the source sends none
  glm::vec3 wind_mps{0.0f};  // valid when has_wind_stream
  bool has_motion = false;   // a motion sample was ever used
  bool has_wind_stream = false;
  bool is_motion_stale = true;    // none accepted for kMotionStaleNs (input_hub.h)
  bool has_teleported = false;    // the pose jumped since the last frame: strands follow rigidly
  double motion_speed = 1.0;      // played at this share of real time, to go with a slow simulation
  int64_t motion_time_ns = 0;     // server clock at arrival of the newest sample used, 0 = none
  uint64_t rejected_samples = 0;  // since start
  std::optional<Timecode> timecode =
      {};  // of the motion that it shows, else of the clock; none: nobody counts

  bool operator==(const InputFrame&) const = default;
};

}  // namespace strandcast
