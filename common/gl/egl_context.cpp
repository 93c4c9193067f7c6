#include "common/gl/egl_context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>

#include "common/gl/objects.h"
#include "common/log/log.h"

namespace strandcast::gl {
namespace {

constexpr int kMajorVersion = 4;
constexpr int kMinorVersion = 5;
constexpr EGLint kMaxDevices = 64;

bool has_word(const char* words, std::string_view word) {
  std::string_view rest = words == nullptr ? "" : words;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find(' '), rest.size());
    if (rest.substr(0, end) == word) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

/// One way to reach a device.
struct Candidate {
  std::string name;  // as listed in errors
  EGLenum platform = 0;
  void* native = nullptr;
  bool may_be_hardware = true;
  bool may_be_software = true;
};

/// A display with a context that is current on this thread.
struct Opened {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  DeviceInfo info;
};

Error egl_error(const char* step) {
  return make_error(ErrorCode::Unavailable, "{} failed with EGL error 0x{:x}", step,
                    static_cast<unsigned>(eglGetError()));
}

std::vector<Candidate> list_devices() {
  std::array<EGLDeviceEXT, kMaxDevices> devices{};
  EGLint count = 0;
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const bool can_list =
      has_word(extensions, "EGL_EXT_device_base") ||
      (has_word(extensions, "EGL_EXT_device_enumeration") && has_word(extensions, "EGL_EXT_device_query"));
  if (!can_list || !has_word(extensions, "EGL_EXT_platform_device")) return {};
  if (eglQueryDevicesEXT(kMaxDevices, devices.data(), &count) != EGL_TRUE) return {};
  std::vector<Candidate> candidates;
  for (EGLint i = 0; i < count; ++i) {
    EGLDeviceEXT device = devices[static_cast<size_t>(i)];
    const bool is_software =
        has_word(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
    candidates.push_back({fmt::format("device {} ({})", i, is_software ? "software" : "hardware"),
                          EGL_PLATFORM_DEVICE_EXT, device, !is_software, is_software});
  }
  return candidates;
}

/// Mesa's own platform; beside another vendor's GPU it picks software rendering.
std::vector<Candidate> list_surfaceless(bool may_be_hardware, bool may_be_software) {
  if (!has_word(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless")) return {};
  return {{"surfaceless Mesa", EGL_PLATFORM_SURFACELESS_MESA, reinterpret_cast<void*>(EGL_DEFAULT_DISPLAY),
           may_be_hardware, may_be_software}};
}

/// The order in which `device` is tried.
Result<std::vector<Candidate>> choose_candidates(const std::string& device, DriverThreads threads) {
  const std::vector<Candidate> devices = list_devices();
  std::vector<Candidate> hardware, software;
  if (device == "auto" || device == "hardware" || device == "software") {
    for (const Candidate& candidate : devices)
      (candidate.may_be_hardware ? hardware : software).push_back(candidate);
    if (device == "software") hardware.clear();
    if (device == "hardware") software.clear();
  } else {
    size_t number = 0;
    const char* end = device.data() + device.size();
    const auto parsed = std::from_chars(device.data(), end, number);
    if (parsed.ec != std::errc() || parsed.ptr != end || number >= devices.size())
      return make_error(ErrorCode::NotFound, "unknown GL device '{}' (known: auto, software, hardware{})",
                        device, devices.empty() ? "" : fmt::format(", 0 to {}", devices.size() - 1));
    (devices[number].may_be_hardware ? hardware : software).push_back(devices[number]);
  }
  std::vector<Candidate> chosen = hardware;
  const auto append = [&](const std::vector<Candidate>& more) {
    chosen.insert(chosen.end(), more.begin(), more.end());
  };
  // A display of its own brings threads of its own; the surfaceless one is the second way to the same
  // renderer.
  if (threads == DriverThreads::Own && !software.empty()) append(list_surfaceless(false, true));
  append(software);
  if (device == "auto" || device == "hardware" || device == "software")
    append(list_surfaceless(device != "software", device != "hardware"));
  return chosen;
}

Result<EGLConfig> choose_config(EGLDisplay display) {
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!has_word(extensions, "EGL_KHR_surfaceless_context"))
    return make_error(ErrorCode::Unsupported, "it lacks EGL_KHR_surfaceless_context");
  if (has_word(extensions, "EGL_KHR_no_config_context")) return EGLConfig(EGL_NO_CONFIG_KHR);
  const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display, wanted, &config, 1, &count) != EGL_TRUE || count < 1)
    return egl_error("eglChooseConfig");
  return config;
}

struct Displays {
  std::mutex mutex;           // guards the set, and that nobody ends a display that another thread is opening
  std::set<EGLDisplay> used;  // had a context
};
Displays& displays() {
  static Displays all;
  return all;
}

/// Displays that had a context stay initialised until the process ends: every context of one device shares
/// its display, so ending it for one would end it for the others. One that turned out not to be what was
/// asked for, and that nobody uses, is ended, and the threads of its driver with it.
Result<Opened> open(const Candidate& candidate) {
  const std::lock_guard lock(displays().mutex);
  Opened opened;
  opened.display = eglGetPlatformDisplayEXT(candidate.platform, candidate.native, nullptr);
  if (opened.display == EGL_NO_DISPLAY) return egl_error("eglGetPlatformDisplay");
  if (eglInitialize(opened.display, nullptr, nullptr) != EGL_TRUE) return egl_error("eglInitialize");
  ASSIGN_OR_RETURN(EGLConfig config, choose_config(opened.display));
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return egl_error("eglBindAPI(OpenGL)");
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               kMajorVersion,
                               EGL_CONTEXT_MINOR_VERSION,
                               kMinorVersion,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  opened.context = eglCreateContext(opened.display, config, EGL_NO_CONTEXT, attributes);
  if (opened.context == EGL_NO_CONTEXT) return egl_error("eglCreateContext(OpenGL 4.5 core)");
  if (eglMakeCurrent(opened.display, EGL_NO_SURFACE, EGL_NO_SURFACE, opened.context) != EGL_TRUE) {
    const Error error = egl_error("eglMakeCurrent");
    eglDestroyContext(opened.display, opened.context);
    return error;
  }
  auto info = read_device_info();
  if (info && (info->is_software ? candidate.may_be_software : candidate.may_be_hardware)) {
    opened.info = std::move(info).value();
    displays().used.insert(opened.display);
    return opened;
  }
  const Error error =
      info ? make_error(ErrorCode::Unavailable, "it renders with {}", info->renderer) : info.error();
  eglMakeCurrent(opened.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(opened.display, opened.context);
  if (!displays().used.contains(opened.display)) eglTerminate(opened.display);
  return error;
}

/// The loader of GL entry points stops the process when libEGL is missing; this finds out first.
bool has_egl_library() {
  void* library = dlopen("libEGL.so.1", RTLD_LAZY | RTLD_LOCAL);
  return library != nullptr;  // stays loaded: it is needed from here on
}

void GLAPIENTRY log_debug_message(GLenum, GLenum type, GLuint, GLenum severity, GLsizei,
                                  const GLchar* message, const void*) {
  if (severity == GL_DEBUG_SEVERITY_HIGH || type == GL_DEBUG_TYPE_ERROR)
    log_error("gl", "{}", message);
  else
    log_warn("gl", "{}", message);
}

}  // namespace

Result<std::unique_ptr<EglContext>> EglContext::make(const std::string& device, DriverThreads threads) {
  if (!has_egl_library())
    return make_error(ErrorCode::Unavailable, "no OpenGL: libEGL.so.1 is not installed (package libegl1)");
  ASSIGN_OR_RETURN(const auto candidates, choose_candidates(device, threads));
  std::vector<std::string> tried;
  for (const Candidate& candidate : candidates) {
    auto opened = open(candidate);
    if (!opened) {
      tried.push_back(candidate.name + ": " + opened.error().message);
      continue;
    }
    std::unique_ptr<EglContext> context(new EglContext);
    context->display_ = opened->display;
    context->context_ = opened->context;
    context->info_ = opened->info;
    count_context(1);
    return context;
  }
  return make_error(ErrorCode::Unavailable, "no OpenGL 4.5 context for GL device '{}' (tried: {})", device,
                    tried.empty() ? "nothing, EGL lists no such device; libgl1-mesa-dri draws without a GPU"
                                  : fmt::format("{}", fmt::join(tried, "; ")));
}

EglContext::~EglContext() {
  if (context_ == nullptr) return;
  if (eglGetCurrentContext() == context_) release();
  eglDestroyContext(display_, context_);
  count_context(-1);
}

Status EglContext::make_current() {
  // The bound API is kept per thread and starts as OpenGL ES.
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return egl_error("eglBindAPI(OpenGL)");
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE)
    return egl_error("eglMakeCurrent");
  return {};
}

void EglContext::release() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

Result<DeviceInfo> read_device_info() {
  const auto text = [](GLenum name) {
    const auto* value = reinterpret_cast<const char*>(glGetString(name));
    return std::string(value == nullptr ? "" : value);
  };
  DeviceInfo info;
  info.renderer = text(GL_RENDERER);
  info.vendor = text(GL_VENDOR);
  info.version = text(GL_VERSION);
  GLint major = 0, minor = 0, profile = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
  glGetIntegerv(GL_MAX_SAMPLES, &info.max_samples);
  const bool is_new_enough = major > kMajorVersion || (major == kMajorVersion && minor >= kMinorVersion);
  if (!is_new_enough || (profile & GL_CONTEXT_CORE_PROFILE_BIT) == 0)
    return make_error(ErrorCode::Unsupported, "OpenGL 4.5 core is needed, '{}' has '{}'", info.renderer,
                      info.version);
  info.limits = read_device_limits();
  RETURN_IF_ERROR(check_device_limits(info.limits));
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"})
    info.is_software = info.is_software || info.renderer.find(name) != std::string::npos;
  return info;
}

void enable_debug_log() {
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);  // the message then belongs to the call that is on the stack
  glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DEBUG_SEVERITY_LOW, 0, nullptr, GL_FALSE);
  glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DEBUG_SEVERITY_NOTIFICATION, 0, nullptr, GL_FALSE);
  glDebugMessageCallback(log_debug_message, nullptr);
}

}  // namespace strandcast::gl
