// Draws the panels over the picture with Dear ImGui, between its NewFrame() and Render(). Main thread only.
#pragma once

#include "client/window/hud.h"

namespace strandcast {

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
