// Draws the form beside the picture with Dear ImGui, between its NewFrame() and Render(). Main thread only.
#pragma once

#include "client/window/form.h"
#include "client/window/hud_panel.h"

namespace strandcast {

/// Draws the form at the right edge, at most as high as the window. Adds the person's edits to `actions`.
PanelSize draw_form_panel(const FormState& form, FormActions& actions);

}  // namespace strandcast
