#include "server/record/recorded_step.h"

namespace strandcast {

RecordedStep to_recorded(const TakenStep& step) {
  const InputFrame& input = step.input;
  RecordedStep recorded;
  recorded.tick = step.tick;
  recorded.time_ns = step.time_ns;
  recorded.input_rate = step.input_rate;
  recorded.world_from_head = input.world_from_head;
  recorded.joints = input.joints;
  recorded.wind_mps = input.wind_mps;
  recorded.has_motion = input.has_motion;
  recorded.has_wind_stream = input.has_wind_stream;
  recorded.is_motion_stale = input.is_motion_stale;
  recorded.has_teleported = input.has_teleported;
  recorded.motion_speed = input.motion_speed;
  recorded.motion_time_ns = input.motion_time_ns;
  recorded.rejected_samples = input.rejected_samples;
  recorded.timecode = input.timecode;
  return recorded;
}

TakenStep to_taken(const RecordedStep& recorded) {
  TakenStep step{recorded.tick, recorded.time_ns, recorded.input_rate, {}};
  InputFrame& input = step.input;
  input.world_from_head = recorded.world_from_head;
  input.joints = recorded.joints;
  input.wind_mps = recorded.wind_mps;
  input.has_motion = recorded.has_motion;
  input.has_wind_stream = recorded.has_wind_stream;
  input.is_motion_stale = recorded.is_motion_stale;
  input.has_teleported = recorded.has_teleported;
  input.motion_speed = recorded.motion_speed;
  input.motion_time_ns = recorded.motion_time_ns;
  input.rejected_samples = recorded.rejected_samples;
  input.timecode = recorded.timecode;
  return step;
}

}  // namespace strandcast
