// Window: a GLFW window with a GL 4.5 core context, its mouse and keys as actions, and the panel drawn with
// Dear ImGui. Main thread only. Knows nothing of servers or hair: the application draws into its framebuffer.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <string>

#include "client/window/hud.h"
#include "common/base/result.h"
#include "common/pictures/image_codec.h"
#include "common/render/renderer.h"

namespace strandcast {

/// What the person asked for since the last call.
struct WindowActions {
  bool wants_quit = false;            // Esc, Q, or the window was closed
  bool wants_pause_toggle = false;    // Space
  bool wants_step = false;            // N
  bool wants_view_reset = false;      // R
  bool wants_screenshot = false;      // S
  bool wants_mode_toggle = false;     // M: strands, frames or auto
  bool wants_playout_toggle = false;  // P: low latency or smooth
  glm::vec2 orbit_heights{0.0f};      // left drag, in window heights
  glm::vec2 pan_heights{0.0f};        // middle or right drag
  float zoom_steps = 0.0f;            // wheel
};

class Window {
 public:
  /// Opens the window, hidden, and makes its context current: OpenGL 4.5, or 3.3 for pictures only.
  /// Unavailable without a display, and says what to do then.
  static Result<std::unique_ptr<Window>> open(const std::string& title, RenderSize size);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void show();
  /// Why strands cannot be drawn in this window; empty when they can.
  const std::string& why_no_strands() const;

  /// Handles events and begins a picture.
  WindowActions begin_picture();
  /// Size of the framebuffer, pixels; 0 x 0 while minimised.
  RenderSize framebuffer_size() const;
  /// Fills the framebuffer with a dark grey, for when there is nothing to show yet.
  void clear();
  /// Fills the window with a picture (frames mode), scaled to fit.
  void show_image(const Image& image, uint64_t image_number);
  /// Draws the panel and the help over whatever was drawn, and shows the picture; waits for the display.
  void end_picture(const HudState& hud);

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
