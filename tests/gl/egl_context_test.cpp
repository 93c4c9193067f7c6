#include "common/gl/egl_context.h"

#include <epoxy/gl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "common/gl/objects.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::gl::egl_context_test {
namespace {

using testing::HasSubstr;

TEST(EglContext, GivesAContextWithTheFactsOfItsDevice) {
  const auto context = EglContext::make("auto");
  ASSERT_TRUE(context) << context.error().to_string();
  const DeviceInfo& info = (*context)->info();
  EXPECT_FALSE(info.renderer.empty());
  EXPECT_GE(info.max_samples, 4);  // every GL 4.5 device has 4
  EXPECT_EQ(info.is_software, info.renderer.find("llvmpipe") != std::string::npos);
}

TEST(EglContext, TakesSoftwareAndDeviceNumbers) {
  for (const char* device : {"software", "0"}) {
    const auto context = EglContext::make(device);
    ASSERT_TRUE(context) << device << ": " << context.error().to_string();
    EXPECT_TRUE(device != std::string("software") || (*context)->info().is_software);
  }
}

TEST(EglContext, HardwareIsNeverASoftwareRenderer) {
  const auto context = EglContext::make("hardware");
  if (context) {
    EXPECT_FALSE((*context)->info().is_software);
  } else {
    EXPECT_THAT(context.error().message, HasSubstr("tried: "));
  }
}

TEST(EglContext, NamesTheKnownDevicesForAnUnknownOne) {
  for (const char* device : {"", "gpu", "999", "-1", "0x"}) {
    const auto context = EglContext::make(device);
    ASSERT_FALSE(context) << device;
    EXPECT_EQ(context.error().code, ErrorCode::NotFound);
    EXPECT_THAT(context.error().message, HasSubstr("known: auto, software, hardware"));
  }
}

TEST(EglContext, TwoContextsOfOneDeviceLiveSideBySide) {
  auto first = EglContext::make("auto");
  auto second = EglContext::make("auto");
  ASSERT_TRUE(first && second);
  second->reset();  // must not take the display away from the first
  ASSERT_TRUE((*first)->make_current());
  EXPECT_EQ(Buffer::of("four", std::vector<int>{1, 2, 3, 4}).read_all<int>(), (std::vector<int>{1, 2, 3, 4}));
}

/// Threads of this process that run at the given nice value.
int count_threads_at_nice(int nice) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task"))
    count += getpriority(PRIO_PROCESS, static_cast<id_t>(std::stoi(entry.path().filename()))) == nice ? 1 : 0;
  return count;
}

/// Makes a shared and then two niced contexts; true when only the one with threads of its own brings any.
bool own_threads_are_new() {
  constexpr int kNice = 7;
  const auto shared = EglContext::make("software");
  bool is_right = static_cast<bool>(shared);
  std::thread([&] {
    setpriority(PRIO_PROCESS, 0, kNice);
    const auto also_shared = EglContext::make("software", DriverThreads::Shared);
    is_right = is_right && also_shared && count_threads_at_nice(kNice) == 1;  // this thread
    const auto own = EglContext::make("software", DriverThreads::Own);
    is_right = is_right && own && count_threads_at_nice(kNice) > 1;
    is_right = is_right && (*own)->info().renderer == (*shared)->info().renderer;
  }).join();
  return is_right;
}

TEST(EglContext, OwnDriverThreadsAreANewSetAtThePriorityOfTheirMaker) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a fresh process: displays live as long as it does
  EXPECT_EXIT(_exit(own_threads_are_new() ? 0 : 1), testing::ExitedWithCode(0), "");
}

size_t count_threads() {
  size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) count += entry.exists();
  return count;
}

/// Looks for hardware, and makes do without. True when a search in vain leaves nothing running, and takes
/// nothing from a context that is there.
bool search_leaves_nothing() {
  const size_t before = count_threads();
  if (const auto hardware = EglContext::make("hardware")) return true;  // not in vain
  if (count_threads() != before) return false;
  const auto own = EglContext::make("software", DriverThreads::Own);
  if (!own) return false;
  if (const auto hardware = EglContext::make("hardware")) return false;
  if (!(*own)->make_current()) return false;
  return Buffer::of("two", std::vector<int>{7, 8}).read_all<int>() == std::vector<int>{7, 8};
}

TEST(EglContext, ASearchForHardwareInVainLeavesNoThreadsBehind) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a fresh process, in which no display was opened
  EXPECT_EXIT(_exit(search_leaves_nothing() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(EglContext, MovesToAnotherThread) {
  auto context = EglContext::make("auto");
  ASSERT_TRUE(context);
  (*context)->release();
  std::vector<int> seen;
  std::thread([&] {
    ASSERT_TRUE((*context)->make_current());
    seen = Buffer::of("two", std::vector<int>{5, 6}).read_all<int>();
    (*context)->release();
  }).join();
  EXPECT_EQ(seen, (std::vector<int>{5, 6}));
}

TEST(EglContext, AMachineWithoutDriversGetsOneSentence) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a fresh process: EGL looks for drivers once
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent", 1);
        const auto context = EglContext::make("auto");
        const bool is_expected = !context && context.error().code == ErrorCode::Unavailable;
        fprintf(stderr, "%s\n", context ? "a context" : context.error().to_string().c_str());
        _exit(is_expected ? 0 : 1);
      },
      testing::ExitedWithCode(0), "no OpenGL 4.5 context for GL device 'auto'");
}

TEST(DeviceInfo, ADebugMessageIsNoError) {
  const auto context = EglContext::make("auto");
  ASSERT_TRUE(context);
  enable_debug_log();
  glDebugMessageInsert(GL_DEBUG_SOURCE_APPLICATION, GL_DEBUG_TYPE_OTHER, 1, GL_DEBUG_SEVERITY_MEDIUM, -1,
                       "hello");
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

}  // namespace
}  // namespace strandcast::gl::egl_context_test
