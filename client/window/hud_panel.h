// The panels over the picture, drawn with Dear ImGui between begin_picture() and end_picture(). Main thread
// only.
#pragma once

#include "client/window/hud.h"

namespace strandcast {

/// Measurements, top left.
void draw_hud_panel(const HudState& hud);
/// Mouse and keys, bottom right.
void draw_help_panel();
/// What is wrong with the connection, in the middle.
void draw_connection_banner(const HudState& hud);

}  // namespace strandcast
