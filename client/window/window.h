// Window: a GLFW window that reports mouse and keys as actions and shows a picture with panels over it, drawn
// with Dear ImGui and plain OpenGL 3.3. It draws nothing that takes long. Main thread only, except for
// wake(). Knows nothing of servers or hair.
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

/// Actions of the person since the last call.
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

/// How a picture is shown whose shape differs from the window's.
enum class PictureFit { Inside, Stretched };

class Window {
 public:
  /// Opens the window. Unavailable without a display; the error names a remedy.
  static Result<std::unique_ptr<Window>> open(const std::string& title, RenderSize size);
  /// Checks whether there is a display without opening a window. Must not be called while there is one.
  static Status check_display();
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Waits for an action, a call of wake() or the timeout.
  WindowActions wait(std::chrono::milliseconds timeout);
  /// Ends the wait. Any thread, while there is a window.
  static void wake();
  /// Returns the framebuffer's size in pixels; 0 x 0 while minimised.
  RenderSize framebuffer_size() const;
  /// Returns whether the person has unfolded the measurements (U).
  bool is_unfolded() const;
  /// Returns whether the person has opened the form (L).
  bool is_form_visible() const;
  /// Shows the picture (dark grey if null) with the panels over it, and the form if it is given and open.
  /// Waits for the display and returns once the picture was passed to it. Edits in the form come with the
  /// next wait().
  void present(const std::shared_ptr<const Image>& image, PictureFit fit, const HudState& hud,
               const std::optional<FormState>& form);

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
