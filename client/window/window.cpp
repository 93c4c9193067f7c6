#include "client/window/window.h"

#include <epoxy/gl.h>
// epoxy first: GLFW must not bring in another set of GL declarations.
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>

#include <algorithm>
#include <utility>

#include "client/window/hud_panel.h"
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

/// A window with a core context of this version; null when there is none.
GLFWwindow* make_window(const std::string& title, RenderSize size, int major, int minor) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, major);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, minor);
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
  bool is_hud_visible = true;
  bool is_help_visible = false;
  glm::dvec2 cursor{0.0};
  WindowActions actions;
  std::string why_no_strands;
  GLuint picture = 0;  // plain OpenGL 3.3: it must work where nothing better is to be had
  RenderSize picture_size{0, 0};
  uint64_t picture_number = 0;

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

  void on_key(int key) {
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
      case GLFW_KEY_U:
        is_hud_visible = !is_hud_visible;
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
    int width = 0;
    int height = 0;
    glfwGetWindowSize(window, &width, &height);
    if (height <= 0 || ImGui::GetIO().WantCaptureMouse) return;
    const glm::vec2 heights(moved / static_cast<double>(height));
    const auto is_down = [this](int button) { return glfwGetMouseButton(window, button) == GLFW_PRESS; };
    if (is_down(GLFW_MOUSE_BUTTON_LEFT)) actions.orbit_heights += heights;
    if (is_down(GLFW_MOUSE_BUTTON_MIDDLE) || is_down(GLFW_MOUSE_BUTTON_RIGHT)) actions.pan_heights += heights;
  }

  void install_callbacks() {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* source, int key, int, int action, int) {
      if (action == GLFW_PRESS) static_cast<State*>(glfwGetWindowUserPointer(source))->on_key(key);
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* source, double x, double y) {
      static_cast<State*>(glfwGetWindowUserPointer(source))->on_cursor({x, y});
    });
    glfwSetScrollCallback(window, [](GLFWwindow* source, double, double steps) {
      static_cast<State*>(glfwGetWindowUserPointer(source))->actions.zoom_steps += static_cast<float>(steps);
    });
  }
};

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;

Result<std::unique_ptr<Window>> Window::open(const std::string& title, RenderSize size) {
  glfwSetErrorCallback(remember_glfw_error);
  if (glfwInit() != GLFW_TRUE) return no_window("cannot open a display");
  auto state = std::make_unique<State>();
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  state->window = make_window(title, size, 4, 5);
  if (state->window == nullptr) {
    state->why_no_strands = fmt::format("this machine has no OpenGL 4.5 ({})", last_glfw_error());
    state->window = make_window(title, size, 3, 3);
  }
  if (state->window == nullptr) return no_window("cannot open a window with OpenGL 4.5 or 3.3");
  glfwMakeContextCurrent(state->window);
  glfwSwapInterval(1);
  glfwGetCursorPos(state->window, &state->cursor.x, &state->cursor.y);

  // Ours first: the panel's own callbacks call those that were there before.
  state->install_callbacks();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no files behind
  ImGui_ImplGlfw_InitForOpenGL(state->window, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
  state->has_imgui = true;
  return std::unique_ptr<Window>(new Window(std::move(state)));
}

void Window::show() {
  glfwShowWindow(state_->window);
}

const std::string& Window::why_no_strands() const {
  return state_->why_no_strands;
}

WindowActions Window::begin_picture() {
  glfwPollEvents();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  WindowActions actions = std::exchange(state_->actions, {});
  if (glfwWindowShouldClose(state_->window) == GLFW_TRUE) actions.wants_quit = true;
  return actions;
}

RenderSize Window::framebuffer_size() const {
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(state_->window, &width, &height);
  return {static_cast<uint32_t>(std::max(width, 0)), static_cast<uint32_t>(std::max(height, 0))};
}

void Window::show_image(const Image& image, uint64_t image_number) {
  const auto width = static_cast<GLsizei>(image.width);
  const auto height = static_cast<GLsizei>(image.height);
  if (state_->picture == 0) glGenTextures(1, &state_->picture);
  glBindTexture(GL_TEXTURE_2D, state_->picture);
  if (state_->picture_size.width != image.width || state_->picture_size.height != image.height) {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    state_->picture_size = {image.width, image.height};
    state_->picture_number = 0;
  }
  if (state_->picture_number != image_number) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
    state_->picture_number = image_number;
  }
  glBindTexture(GL_TEXTURE_2D, 0);
  const ImVec2 area = ImGui::GetIO().DisplaySize;
  const float scale =
      std::min(area.x / static_cast<float>(image.width), area.y / static_cast<float>(image.height));
  const ImVec2 shown(scale * static_cast<float>(image.width), scale * static_cast<float>(image.height));
  const ImVec2 corner((area.x - shown.x) * 0.5f, (area.y - shown.y) * 0.5f);
  ImGui::GetBackgroundDrawList()->AddImage(reinterpret_cast<ImTextureID>(uintptr_t{state_->picture}), corner,
                                           ImVec2(corner.x + shown.x, corner.y + shown.y));
}

void Window::end_picture(const HudState& hud) {
  // The renderer leaves its own target bound; the panel's backend draws into whatever it finds.
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glDisable(GL_FRAMEBUFFER_SRGB);
  glDisable(GL_RASTERIZER_DISCARD);
  if (state_->is_hud_visible) draw_hud_panel(hud);
  if (state_->is_help_visible) draw_help_panel();
  if (!hud.is_connected) draw_connection_banner(hud);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(state_->window);
}

void Window::clear() {
  const RenderSize size = framebuffer_size();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, static_cast<GLsizei>(size.width), static_cast<GLsizei>(size.height));
  constexpr float kDarkGrey = 0.1f;
  glClearColor(kDarkGrey, kDarkGrey, kDarkGrey, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
}

}  // namespace strandcast
