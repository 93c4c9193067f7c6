// The form beside the picture, drawn with Dear ImGui between its NewFrame() and Render(). Main thread only.
#pragma once

#include "client/window/form.h"
#include "client/window/hud_panel.h"

namespace strandcast {

/// At the right edge, as high as the window at most. Adds what the person does to `actions`.
PanelSize draw_form_panel(const FormState& form, FormActions& actions);

}  // namespace strandcast
