#include "client/window/window.h"

#include <epoxy/gl.h>
// epoxy first: GLFW must not bring in another set of GL declarations.
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <utility>

#include "client/window/form.h"
#include "client/window/hud.h"
#include "common/base/units.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

std::string& last_glfw_error() {
  static std::string text;
  return text;
}

void remember_glfw_error(int, const char* description) {
  last_glfw_error() = description;
  log_debug("window", "GLFW: {}", description);
}

/// A window with a core context of what the panels need; null when there is none.
GLFWwindow* make_window(const std::string& title, RenderSize size) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  return glfwCreateWindow(static_cast<int>(size.width), static_cast<int>(size.height), title.c_str(), nullptr,
                          nullptr);
}

Error no_window(const char* what) {
  return make_error(ErrorCode::Unavailable,
                    "{}: {} (without a display use --headless --screenshot FILE or --headless --clip FILE)",
                    what, last_glfw_error().empty() ? "no reason given" : last_glfw_error());
}

}  // namespace

struct Window::State {
  GLFWwindow* window = nullptr;
  bool has_imgui = false;
  HudFold fold = HudFold::Small;
  bool is_help_visible = false;
  bool is_form_visible = false;
  bool has_timeline = false;  // in the newest picture
  bool is_minimised = false;
  glm::dvec2 cursor{0.0};
  WindowActions actions;
  GLuint picture = 0;  // plain OpenGL 3.3: it must work where nothing better is to be had
  RenderSize picture_size{0, 0};
  std::shared_ptr<const Image> uploaded;  // what is in it

  ~State() {
    if (picture != 0) glDeleteTextures(1, &picture);  // needs the context that goes below
    if (has_imgui) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui_ImplGlfw_Shutdown();
      ImGui::DestroyContext();
    }
    if (window != nullptr) glfwDestroyWindow(window);
    glfwTerminate();
  }

  /// Keys that go from one field of the form to the next, and turn it.
  static bool moves_in_form(int key) {
    return key == GLFW_KEY_UP || key == GLFW_KEY_DOWN || key == GLFW_KEY_LEFT || key == GLFW_KEY_RIGHT ||
           key == GLFW_KEY_SPACE || key == GLFW_KEY_ESCAPE;
  }

  /// Something on the screen answers to the pointer.
  bool has_widgets() const { return is_form_visible || has_timeline; }

  void on_key(int key) {
    actions.is_touched = true;
    if (is_form_visible && ImGui::GetIO().WantTextInput) return;  // it is being typed
    if (is_form_visible && ImGui::GetIO().NavVisible && moves_in_form(key)) return;
    switch (key) {
      case GLFW_KEY_ESCAPE:
      case GLFW_KEY_Q:
        actions.wants_quit = true;
        break;
      case GLFW_KEY_SPACE:
        actions.wants_pause_toggle = true;
        break;
      case GLFW_KEY_N:
        actions.wants_step = true;
        break;
      case GLFW_KEY_R:
        actions.wants_view_reset = true;
        break;
      case GLFW_KEY_S:
        actions.wants_screenshot = true;
        break;
      case GLFW_KEY_M:
        actions.wants_mode_toggle = true;
        break;
      case GLFW_KEY_P:
        actions.wants_playout_toggle = true;
        break;
      case GLFW_KEY_V:
        actions.wants_debug_view = true;
        break;
      case GLFW_KEY_F9:
        actions.wants_record_toggle = true;
        break;
      case GLFW_KEY_RIGHT:
        ++actions.state_steps;
        break;
      case GLFW_KEY_LEFT:
        --actions.state_steps;
        break;
      case GLFW_KEY_UP:
        ++actions.speed_steps;
        break;
      case GLFW_KEY_DOWN:
        --actions.speed_steps;
        break;
      case GLFW_KEY_HOME:
        actions.wants_beginning = true;
        break;
      case GLFW_KEY_END:
        actions.wants_end = true;
        break;
      case GLFW_KEY_O:
        actions.timeline.wants_loop_toggle = true;
        break;
      case GLFW_KEY_U:
        fold = next_fold(fold);
        break;
      case GLFW_KEY_L:
        is_form_visible = !is_form_visible;
        break;
      case GLFW_KEY_H:
      case GLFW_KEY_F1:
        is_help_visible = !is_help_visible;
        break;
      default:
        break;
    }
  }

  void on_cursor(const glm::dvec2& position) {
    const glm::dvec2 moved = position - cursor;
    cursor = position;
    // Its fields answer to the pointer.
    actions.is_touched = actions.is_touched || has_widgets();
    int width = 0;
    int height = 0;
    glfwGetWindowSize(window, &width, &height);
    if (height <= 0 || ImGui::GetIO().WantCaptureMouse) return;
    const glm::vec2 heights(moved / static_cast<double>(height));
    const auto is_down = [this](int button) { return glfwGetMouseButton(window, button) == GLFW_PRESS; };
    if (is_down(GLFW_MOUSE_BUTTON_LEFT)) actions.orbit_heights += heights;
    if (is_down(GLFW_MOUSE_BUTTON_MIDDLE) || is_down(GLFW_MOUSE_BUTTON_RIGHT)) actions.pan_heights += heights;
    actions.is_touched = actions.is_touched || actions.orbit_heights != glm::vec2(0.0f) ||
                         actions.pan_heights != glm::vec2(0.0f);
  }

  void install_callbacks() {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* source, int key, int, int action, int) {
      const bool is_repeated = action == GLFW_REPEAT && (key == GLFW_KEY_LEFT || key == GLFW_KEY_RIGHT);
      if (action == GLFW_PRESS || is_repeated)
        static_cast<State*>(glfwGetWindowUserPointer(source))->on_key(key);
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* source, double x, double y) {
      static_cast<State*>(glfwGetWindowUserPointer(source))->on_cursor({x, y});
    });
    glfwSetScrollCallback(window, [](GLFWwindow* source, double, double steps) {
      WindowActions& wanted = static_cast<State*>(glfwGetWindowUserPointer(source))->actions;
      wanted.is_touched = true;
      if (!ImGui::GetIO().WantCaptureMouse) wanted.zoom_steps += static_cast<float>(steps);
    });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* source, int, int, int) {
      State& state = *static_cast<State*>(glfwGetWindowUserPointer(source));
      state.actions.is_touched = state.actions.is_touched || state.has_widgets();
    });
    glfwSetCharCallback(window, [](GLFWwindow* source, unsigned int) {
      State& state = *static_cast<State*>(glfwGetWindowUserPointer(source));
      state.actions.is_touched = state.actions.is_touched || state.has_widgets();
    });
    // Uncovered, or of another size: the old picture is gone.
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* source) {
      static_cast<State*>(glfwGetWindowUserPointer(source))->actions.is_touched = true;
    });
    // Minimised, it keeps its size on X11.
    glfwSetWindowIconifyCallback(window, [](GLFWwindow* source, int minimised) {
      State& state = *static_cast<State*>(glfwGetWindowUserPointer(source));
      state.is_minimised = minimised == GLFW_TRUE;
      state.actions.is_touched = true;
    });
    glfwSetFramebufferSizeCallback(window, [](GLFWwindow* source, int, int) {
      static_cast<State*>(glfwGetWindowUserPointer(source))->actions.is_touched = true;
    });
  }

  void upload(const std::shared_ptr<const Image>& image);
  void add_picture(const Image& image, PictureFit fit) const;
  void add_panels(const HudState& hud, const std::optional<FormState>& form) {
    draw_hud_panel(hud, fold);
    if (form && is_form_visible) draw_form_panel(*form, actions.form);
    // From the next picture on; without a form the arrows are the recording's.
    ImGuiConfigFlags& flags = ImGui::GetIO().ConfigFlags;
    if (is_form_visible)
      flags |= ImGuiConfigFlags_NavEnableKeyboard;
    else
      flags &= ~ImGuiConfigFlags_NavEnableKeyboard;
    if (hud.banner) draw_banner(*hud.banner);
    if (hud.timeline) draw_timeline(*hud.timeline, actions.timeline);
    if (is_help_visible) draw_help_panel(hud.timeline ? HelpTopic::Recording : HelpTopic::Server);
  }
};

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;

Result<std::unique_ptr<Window>> Window::open(const std::string& title, RenderSize size) {
  glfwSetErrorCallback(remember_glfw_error);
  if (glfwInit() != GLFW_TRUE) return no_window("cannot open a display");
  auto state = std::make_unique<State>();
  state->window = make_window(title, size);
  if (state->window == nullptr) return no_window("cannot open a window with OpenGL 3.3");
  glfwMakeContextCurrent(state->window);
  glfwSwapInterval(1);
  glfwGetCursorPos(state->window, &state->cursor.x, &state->cursor.y);

  // Ours first: the panel's own callbacks call those that were there before.
  state->install_callbacks();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no files behind
  float scale_x = 1.0f;
  float scale_y = 1.0f;
  glfwGetWindowContentScale(state->window, &scale_x, &scale_y);
  set_panel_style(std::max(scale_x, 1.0f));
  ImGui_ImplGlfw_InitForOpenGL(state->window, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  state->has_imgui = true;
  return std::unique_ptr<Window>(new Window(std::move(state)));
}

Status Window::check_display() {
  glfwSetErrorCallback(remember_glfw_error);
  if (glfwInit() != GLFW_TRUE) return no_window("cannot open a display");
  glfwTerminate();
  return {};
}

WindowActions Window::wait(std::chrono::milliseconds timeout) {
  if (timeout.count() > 0)
    glfwWaitEventsTimeout(static_cast<double>(timeout.count()) * kSPerMs);
  else
    glfwPollEvents();
  WindowActions actions = std::exchange(state_->actions, {});
  if (glfwWindowShouldClose(state_->window) == GLFW_TRUE) actions.wants_quit = true;
  return actions;
}

void Window::wake() {
  glfwPostEmptyEvent();
}

RenderSize Window::framebuffer_size() const {
  int width = 0;
  int height = 0;
  if (!state_->is_minimised) glfwGetFramebufferSize(state_->window, &width, &height);
  return {static_cast<uint32_t>(std::max(width, 0)), static_cast<uint32_t>(std::max(height, 0))};
}

void Window::State::upload(const std::shared_ptr<const Image>& image) {
  if (image == uploaded) return;
  const auto width = static_cast<GLsizei>(image->width);
  const auto height = static_cast<GLsizei>(image->height);
  if (picture == 0) glGenTextures(1, &picture);
  glBindTexture(GL_TEXTURE_2D, picture);
  if (picture_size.width != image->width || picture_size.height != image->height) {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    picture_size = {image->width, image->height};
  }
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image->rgba.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  uploaded = image;
}

void Window::State::add_picture(const Image& image, PictureFit fit) const {
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  ImVec2 shown = area;
  if (fit == PictureFit::Inside) {
    const float scale =
        std::min(area.x / static_cast<float>(image.width), area.y / static_cast<float>(image.height));
    shown = ImVec2(scale * static_cast<float>(image.width), scale * static_cast<float>(image.height));
  }
  const ImVec2 corner((area.x - shown.x) * 0.5f, (area.y - shown.y) * 0.5f);
  ImGui::GetBackgroundDrawList()->AddImage(reinterpret_cast<ImTextureID>(uintptr_t{picture}), corner,
                                           ImVec2(corner.x + shown.x, corner.y + shown.y));
}

bool Window::is_unfolded() const {
  return state_->fold == HudFold::Unfolded;
}

bool Window::is_form_visible() const {
  return state_->is_form_visible;
}

void Window::present(const std::shared_ptr<const Image>& image, PictureFit fit, const HudState& hud,
                     const std::optional<FormState>& form) {
  const RenderSize size = framebuffer_size();
  state_->has_timeline = hud.timeline.has_value();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  // Panels learn their size from what they held before: the first time is not drawn.
  ImGui::NewFrame();
  state_->add_panels(hud, form);
  ImGui::EndFrame();
  ImGui::NewFrame();
  if (image != nullptr && !image->rgba.empty()) {
    state_->upload(image);
    state_->add_picture(*image, fit);
  }
  state_->add_panels(hud, form);
  ImGui::Render();
  glViewport(0, 0, static_cast<GLsizei>(size.width), static_cast<GLsizei>(size.height));
  constexpr float kDarkGrey = 0.1f;
  glClearColor(kDarkGrey, kDarkGrey, kDarkGrey, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(state_->window);
  if (!state_->actions.form.is_empty() || !state_->actions.timeline.is_empty()) wake();
}

}  // namespace strandcast
