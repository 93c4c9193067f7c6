// What the window's panels say. Plain data, filled by the application for every picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace strandcast {

struct HudRow {
  std::string label;
  std::string value;
};

/// In the middle of the window while there is no connection.
struct HudBanner {
  std::string headline;  // "connecting to 127.0.0.1:7878"
  std::string trouble;   // why not; may be empty
  std::string help;      // what a person can do; may be empty
  std::string doing;     // what is tried, or what the keys do
};

struct HudState {
  std::string title;                  // what is seen, in one line
  std::vector<std::string> warnings;  // what a person should know now, and the newest notice
  std::vector<HudRow> rows;           // measurements, for the unfolded panel
  std::optional<HudBanner> banner;
};

/// How much of the panel is there.
enum class HudFold { Small, Unfolded, Hidden };
/// Small, unfolded, hidden, and again.
constexpr HudFold next_fold(HudFold fold) {
  return fold == HudFold::Small      ? HudFold::Unfolded
         : fold == HudFold::Unfolded ? HudFold::Hidden
                                     : HudFold::Small;
}

}  // namespace strandcast
