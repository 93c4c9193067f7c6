// The panels over the picture, drawn with Dear ImGui between its NewFrame() and Render(). Main thread only.
#pragma once

#include "client/window/hud.h"

namespace strandcast {

/// Of the window's width, but never less than so many letters.
inline constexpr float kMaxPanelShare = 1.0f / 3.0f;
inline constexpr float kMinPanelLetters = 22.0f;

/// Which keys there are.
enum class HelpTopic { Server, Recording };

/// Width and height on the screen, in the window's units.
struct PanelSize {
  float width = 0.0f;
  float height = 0.0f;
};

/// Colours, corners and letters of all panels, for a screen of so many pixels per unit. Once, before the
/// first panel.
void set_panel_style(float content_scale);
/// Top left: the title and warnings; unfolded, the measurements too.
PanelSize draw_hud_panel(const HudState& hud, HudFold fold);
/// Mouse and keys, in the middle, over all else.
PanelSize draw_help_panel(HelpTopic topic);
/// Along the lower edge. Adds what the person does to `actions`.
PanelSize draw_timeline(const TimelineState& timeline, TimelineActions& actions);
/// What is wrong with the connection, in the middle.
PanelSize draw_banner(const HudBanner& banner);

}  // namespace strandcast
