// The panels over the window's picture: their content, which the application fills for every picture, and the
// functions that draw them with Dear ImGui, between its NewFrame() and Render(), on the main thread only.
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

/// Largest share of the window's width that a panel may take, and its smallest width in letters.
inline constexpr float kMaxPanelShare = 1.0f / 3.0f;
inline constexpr float kMinPanelLetters = 22.0f;

/// Which keys the help explains.
enum class HelpTopic { Server, Recording };

/// Width and height on the screen, in the window's units.
struct PanelSize {
  float width = 0.0f;
  float height = 0.0f;
};

/// Sets colours, corners and letters of all panels for a screen with this many pixels per unit. Call it once
/// before the first panel.
void set_panel_style(float content_scale);
/// Draws the panel at the top left: title and warnings, and measurements if unfolded.
PanelSize draw_hud_panel(const HudState& hud, HudFold fold);
/// Draws the help on mouse and keys in the middle, above everything else.
PanelSize draw_help_panel(HelpTopic topic);
/// Draws the timeline along the lower edge. Adds the person's actions to `actions`.
PanelSize draw_timeline(const TimelineState& timeline, TimelineActions& actions);
/// Draws what is wrong with the connection, in the middle.
PanelSize draw_banner(const HudBanner& banner);

}  // namespace strandcast
