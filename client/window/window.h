// Window: a GLFW window, its mouse and keys as actions, and a picture with panels over it, drawn with Dear
// ImGui and plain OpenGL 3.3. It draws nothing that takes long. Main thread only but for wake(). Knows
// nothing of servers or hair.
#pragma once

#include <chrono>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>

#include "client/window/form.h"
#include "client/window/hud.h"
#include "common/base/picture_size.h"
#include "common/base/result.h"
#include "common/base/units.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

// How a window with hair goes along.
inline constexpr int64_t kDisplayNs = kSInNs / 60;            // no display needs more
inline constexpr int64_t kPanelNs = 250 * kMsInNs;            // how often the numbers of a panel change
inline constexpr int64_t kMessageNs = 4'000 * kMsInNs;        // how long a notice stays on it
inline constexpr std::chrono::milliseconds kLongestWait{50};  // how late a stop is noticed

/// What the person asked for since the last call.
struct WindowActions {
  bool is_touched = false;            // what is shown may have to change: a key, a drag, another size
  bool wants_quit = false;            // Esc, Q, or the window was closed
  bool wants_pause_toggle = false;    // Space
  bool wants_step = false;            // N
  bool wants_view_reset = false;      // R
  bool wants_screenshot = false;      // S
  bool wants_mode_toggle = false;     // M: strands, frames or auto
  bool wants_playout_toggle = false;  // P: low latency or smooth
  bool wants_debug_view = false;      // V: the next one
  bool wants_record_toggle = false;   // F9: begin a recording, or end it
  int state_steps = 0;                // right less left arrow
  int speed_steps = 0;                // up less down arrow
  bool wants_beginning = false;       // Home
  bool wants_end = false;             // End
  glm::vec2 orbit_heights{0.0f};      // left drag, in window heights
  glm::vec2 pan_heights{0.0f};        // middle or right drag
  float zoom_steps = 0.0f;            // wheel
  FormActions form;                   // what was done in the form
  TimelineActions timeline;           // or on the timeline; O wants a loop too
};

/// How a picture of other sides than the window's is shown.
enum class PictureFit { Inside, Stretched };

class Window {
 public:
  /// Opens the window. Unavailable without a display, and says what to do then.
  static Result<std::unique_ptr<Window>> open(const std::string& title, RenderSize size);
  /// Whether there is a display at all; opens nothing. Not while there is a window.
  static Status check_display();
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Waits until something happens, wake() was called or the time is over.
  WindowActions wait(std::chrono::milliseconds timeout);
  /// Ends the wait. Any thread, while there is a window.
  static void wake();
  /// Size of the framebuffer, pixels; 0 x 0 while minimised.
  RenderSize framebuffer_size() const;
  /// Whether the person has unfolded the measurements (U).
  bool is_unfolded() const;
  /// Whether the person has opened the form (L).
  bool is_form_visible() const;
  /// Shows this picture (dark grey when there is none) with the panels over it, the form too when it is given
  /// and open; waits for the display, and returns once it is handed to it. What is done in the form comes
  /// with the next wait().
  void present(const std::shared_ptr<const Image>& image, PictureFit fit, const HudState& hud,
               const std::optional<FormState>& form);

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
