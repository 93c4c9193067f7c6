// Content of the window's panels. Plain data, filled by the application for every picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace strandcast {

struct HudRow {
  std::string label;
  std::string value;
};

/// One part of a bar with several parts.
struct HudPart {
  std::string name;
  double ms = 0.0;
};

/// Text in the middle of the window while there is no connection.
struct HudBanner {
  std::string headline;  // "connecting to 127.0.0.1:7878"
  std::string trouble;   // why not; may be empty
  std::string help;      // what a person can do; may be empty
  std::string doing;     // what is tried, or what the keys do
};

/// Timeline below the picture of a recording.
struct TimelineState {
  double time_s = 0.0;
  double length_s = 0.0;
  double speed = 1.0;
  bool is_playing = false;
  bool is_looping = false;
};
/// A person's actions on the timeline since the last call.
struct TimelineActions {
  std::optional<double> time_s;  // it was dragged to
  std::optional<double> speed;
  bool wants_play_toggle = false;
  bool wants_loop_toggle = false;

  bool is_empty() const { return !time_s && !speed && !wants_play_toggle && !wants_loop_toggle; }
};

struct HudState {
  std::string title;                  // what is seen, in one line
  std::vector<std::string> warnings;  // what a person should know now, and the newest notice
  std::vector<HudRow> rows;           // measurements, for the unfolded panel
  std::vector<HudPart> way;           // from motion to picture, likewise; may be empty
  std::optional<HudBanner> banner;
  std::optional<TimelineState> timeline;  // with it, what is seen is a recording
};

/// How much of the panel is visible.
enum class HudFold { Small, Unfolded, Hidden };
/// Returns the next state, cyclically: small, unfolded, hidden.
constexpr HudFold next_fold(HudFold fold) {
  return fold == HudFold::Small      ? HudFold::Unfolded
         : fold == HudFold::Unfolded ? HudFold::Hidden
                                     : HudFold::Small;
}

}  // namespace strandcast
