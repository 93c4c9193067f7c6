// Reads the #include lines of common/, server/ and client/ and fails on an arrow that the architecture
// forbids.

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "common/base/file.h"

namespace strandcast::layering_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Folders that each folder may include besides itself. A new folder gets a row here.
const std::map<std::string, std::set<std::string>>& allowed_folders() {
  static const std::set<std::string> kBase = {"common/base"};
  static const auto with = [](std::set<std::string> names, const std::set<std::string>& more) {
    names.insert(more.begin(), more.end());
    return names;
  };
  static const std::set<std::string> kMath = with({"common/math"}, kBase);
  static const std::set<std::string> kKernels = with({"common/kernels"}, kMath);
  static const std::set<std::string> kStrands = with({"common/strands"}, kKernels);
  static const std::set<std::string> kReplay = with({"common/replay"}, kStrands);
  static const std::set<std::string> kPictures = with({"common/pictures"}, kStrands);
  static const std::set<std::string> kScene =
      with({"common/scene", "common/motion", "common/groom"}, kStrands);
  static const std::set<std::string> kStreams = with(with(kScene, kPictures), {"common/log"});
  static const std::set<std::string> kWire = with({"common/wire"}, kStreams);
  static const std::set<std::string> kGl = with({"common/gl", "shaders/shared", "common/log"}, kBase);
  static const std::set<std::string> kRender =
      with(with({"common/render", "common/simd", "shaders/lib"}, kGl), kStreams);
  static const std::set<std::string> kAll =
      with(with(with(with(kRender, kWire), kReplay), kKernels), {"common/plot", "common/record"});
  static const std::map<std::string, std::set<std::string>> kAllowed = {
      {"common/base", {}},
      {"common/simd", kBase},
      {"common/log", kBase},
      {"common/plot", kBase},
      {"common/chaos", kBase},
      {"common/math", kBase},
      // The core: a viewer in a browser, a relay or a fuzzer links these and nothing else of ours.
      {"common/kernels", with({"common/simd", "shaders/shared", "shaders/lib"}, kMath)},
      {"common/strands", with({"common/simd"}, kKernels)},
      {"common/replay", with({"common/simd"}, kStrands)},
      {"common/pictures", kPictures},
      {"common/motion", kMath},
      {"common/groom", with({"common/simd"}, kStrands)},
      {"common/scene", kScene},
      {"common/wire", kWire},
      {"common/record", kWire},
      {"common/net", kBase},
      {"common/page", kBase},
      {"common/client", with({"common/net", "common/replay"}, kWire)},
      {"common/gl", kGl},
      {"common/render", kRender},
      {"server/input", kWire},
      {"server/sim", with(with({"common/simd", "shaders/lib"}, kGl), kScene)},
      {"server/scene", with(with({"server/input", "server/sim"}, kGl), kScene)},
      {"server/publish", with(with({"server/sim", "common/simd"}, kGl), kScene)},
      {"server/encode", with({"server/publish"}, kRender)},
      {"server/net", with({"server/input", "common/net", "common/page"}, kWire)},
      {"server/stream", with({"server/encode", "server/publish", "server/net"}, with(kRender, kWire))},
      {"server/source",
       with({"server/input", "server/sim", "server/scene", "server/publish", "server/stream"},
            with(kRender, kWire))},
      {"server/record", with({"server/input", "server/source", "server/stream", "common/record"}, kWire)},
      {"server/app", with({"server/input", "server/sim", "server/scene", "server/publish", "server/encode",
                           "server/net", "server/stream", "server/source", "server/record", "common/client"},
                          kAll)},
      {"server/relay", with({"server/app", "server/net", "common/client"}, kWire)},
      {"server/report", with({"server/input", "server/sim", "server/scene", "server/publish", "server/encode",
                              "server/stream", "server/net", "server/source", "server/app"},
                             kAll)},
      {"server", with({"server/app", "server/net", "server/record", "server/relay", "common/client"}, kAll)},
      {"client/net", with({"common/client", "common/net"}, kWire)},
      // No protobuf, no network, no OpenGL: the page has its own.
      {"client/web",
       with({"common/groom", "common/replay", "common/simd", "common/render", "common/scene"}, kStrands)},
      {"client/window", kAll},
      {"client/export", with({"common/replay", "common/log", "common/groom"}, kStrands)},
      {"client/app", with({"client/net", "client/window", "client/export", "common/chaos", "common/client",
                           "common/page", "common/record"},
                          kAll)},
      {"client", with({"client/app"}, kAll)},
  };
  return kAllowed;
}

/// A header that only some folders (or one kind of file in them) may include.
struct LibraryRule {
  std::string prefix;  // of the included path
  std::set<std::string> folders;
  std::set<std::string> endings = {".h", ".cpp"};  // of the including file
};

const std::vector<LibraryRule>& library_rules() {
  static const std::set<std::string> kProto = {"common/scene", "common/wire"};
  static const std::set<std::string> kNet = {"server/net", "client/net", "common/client", "common/net"};
  static const std::set<std::string> kGl = {"common/gl", "common/render", "server/sim", "server/publish",
                                            "client/window"};
  static const std::set<std::string> kApp = {"server/app", "server/report", "client/app", "server", "client"};
  static const std::vector<LibraryRule> kRules = {
      {"google/protobuf", kProto, {".cpp", "_private.h"}},
      {"strandcast/v1/", kProto, {".cpp"}},
      {"boost/", kNet, {".cpp", "_private.h"}},
      {"openssl/", {"common/net"}, {".cpp"}},
      {"epoxy/", kGl},
      {"EGL/", kGl},
      {"GL/", kGl},
      {"zstd", {"common/strands"}},
      {"spdlog", {"common/log"}},
      {"turbojpeg", {"common/pictures"}},
      {"png.h", {"common/pictures"}},
      {"webp/", {"common/pictures"}},
      {"vpx/", {"common/pictures"}, {".cpp"}},
      {"libav", {"common/pictures"}, {".cpp"}},
      {"libyuv", {"common/pictures"}},
      {"GLFW/", {"client/window"}},
      {"imgui", {"client/window"}},
      {"CLI/", kApp},
      // The stream knows what is decided about sessions, and no socket.
      {"server/net/net_", {"server/net", "server/app", "server/relay"}},
      {"meshoptimizer", {"server/report"}},
      {"draco/", {"server/report"}},
      {"zfp", {"server/report"}},
  };
  return kRules;
}

/// "common/gl" for "common/gl/x.h"; a solver's folder counts as server/sim; "server" for "server/main.cpp".
std::string folder_of(const std::string& path) {
  const size_t first = path.find('/');
  const size_t second = first == std::string::npos ? first : path.find('/', first + 1);
  return path.substr(0, second == std::string::npos ? first : second);
}

std::string check_include(const std::string& path, const std::string& included) {
  const std::string folder = folder_of(path);
  for (const LibraryRule& rule : library_rules()) {
    if (!included.starts_with(rule.prefix)) continue;
    const bool is_right_file = std::any_of(rule.endings.begin(), rule.endings.end(),
                                           [&](const std::string& ending) { return path.ends_with(ending); });
    if (!rule.folders.contains(folder) || !is_right_file)
      return fmt::format("{}: {} is not for this file", path, included);
    return "";
  }
  const std::string top = included.substr(0, included.find('/'));
  if (top != "common" && top != "server" && top != "client" && top != "shaders") return "";
  const std::string target = folder_of(included);
  // The stream that both sides of the network share is private to those who open one.
  const bool is_shared = (target == "common/net" &&
                          (folder == "server/net" || folder == "client/net" || folder == "common/client")) ||
                         (target == "common/client" && folder == "client/net");
  if (included.ends_with("_private.h") && target != folder && !is_shared)
    return fmt::format("{}: {} is private to {}", path, included, target);
  if (target == folder) return "";
  const auto allowed = allowed_folders().find(folder);
  if (allowed == allowed_folders().end())
    return fmt::format("{}: folder {} has no row in the table", path, folder);
  if (!allowed->second.contains(target))
    return fmt::format("{}: {} may not include {}", path, folder, included);
  return "";
}

/// Every wrong include of one file.
std::vector<std::string> check_file(const std::string& path, const std::string& text) {
  std::vector<std::string> wrong;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("#include ")) continue;
    const size_t begin = line.find_first_of("<\"");
    const size_t end = line.find_first_of(">\"", begin + 1);
    if (begin == std::string::npos || end == std::string::npos) continue;
    const std::string included = line.substr(begin + 1, end - begin - 1);
    if (line[begin] == '"' && included.find('/') == std::string::npos)
      wrong.push_back(fmt::format("{}: write \"{}\" from the root of the tree", path, included));
    if (std::string problem = check_include(path, included); !problem.empty())
      wrong.push_back(std::move(problem));
  }
  return wrong;
}

TEST(Layering, EveryIncludeFollowsTheArrows) {
  const std::filesystem::path root(STRANDCAST_SOURCE_DIR);
  std::vector<std::string> wrong;
  int file_count = 0;
  for (const char* top : {"common", "server", "client"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string path = entry.path().lexically_relative(root).generic_string();
      if (!path.ends_with(".h") && !path.ends_with(".cpp")) continue;
      const auto text = load_text(entry.path(), 1u << 20);
      ASSERT_TRUE(text) << text.error().to_string();
      const auto found = check_file(path, *text);
      wrong.insert(wrong.end(), found.begin(), found.end());
      ++file_count;
    }
  }
  EXPECT_THAT(wrong, IsEmpty());
  EXPECT_GT(file_count, 30) << "the walk did not find the sources";
}

TEST(Layering, TheTableHasNoCycle) {
  for (const auto& [folder, targets] : allowed_folders()) {
    for (const std::string& target : targets) {
      const auto back = allowed_folders().find(target);
      if (target == folder || back == allowed_folders().end()) continue;
      EXPECT_FALSE(back->second.contains(folder)) << folder << " and " << target << " include each other";
    }
  }
}

TEST(Layering, FindsEveryKindOfWrongInclude) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"common/base/file.cpp", "#include \"common/math/pose.h\""},
      {"common/motion/clip.cpp", "#include \"common/groom/groom.h\""},
      {"common/groom/groom.cpp", "#include \"common/scene/scene_desc.h\""},
      {"common/strands/snapshot.h", "#include \"common/scene/scene_desc.h\""},
      {"common/strands/snapshot.cpp", "#include \"common/log/log.h\""},
      {"common/replay/snapshot_timeline.h", "#include \"common/render/renderer.h\""},
      {"common/replay/strand_replay.cpp", "#include \"common/wire/messages.h\""},
      {"common/replay/strand_replay.cpp", "#include <spdlog/spdlog.h>"},
      {"common/strands/delta.cpp", "#include \"common/wire/messages.h\""},
      {"common/gl/program.cpp", "#include \"common/render/renderer.h\""},
      {"common/gl/program.cpp", "#include \"common/scene/scene_desc.h\""},
      {"common/strands/delta.cpp", "#include \"common/gl/objects.h\""},
      {"common/render/renderer.cpp", "#include \"server/sim/solver.h\""},
      {"client/app/app.cpp", "#include \"server/net/access.h\""},
      {"server/app/app.cpp", "#include \"server/report/html_page.h\""},
      {"server/net/server.cpp", "#include \"common/replay/strand_replay.h\""},
      {"server/sim/solver.cpp", "#include \"server/scene/stage.h\""},
      {"server/net/server.cpp", "#include \"server/sim/solver.h\""},
      {"common/scene/scene_file.h", "#include <google/protobuf/message.h>"},
      {"common/wire/messages.h", "#include \"strandcast/v1/session.pb.h\""},
      {"server/input/hub.cpp", "#include <google/protobuf/message.h>"},
      {"server/net/server.h", "#include <boost/asio.hpp>"},
      {"common/wire/framing.cpp", "#include <boost/asio.hpp>"},
      {"server/app/app.cpp", "#include \"server/net/beast_private.h\""},
      {"common/strands/delta.cpp", "#include <epoxy/gl.h>"},
      {"server/encode/frame_worker.cpp", "#include <epoxy/gl.h>"},
      {"server/net/server.cpp", "#include <zstd.h>"},
      {"common/pictures/video_codec.h", "#include <vpx/vpx_encoder.h>"},
      {"common/pictures/video_codec.h", "#include <libavcodec/avcodec.h>"},
      {"server/encode/picture_encoder.cpp", "#include <libavcodec/avcodec.h>"},
      {"common/replay/strand_replay.cpp", "#include <GLFW/glfw3.h>"},
      {"server/stream/stream_hub.h", "#include \"server/net/net_server.h\""},
      {"server/stream/stream_hub.h", "#include \"server/sim/solver.h\""},
      {"common/base/log.cpp", "#include \"log.h\""},
      {"server/unheard_of/x.cpp", "#include \"common/base/log.h\""},
  };
  for (const auto& [path, line] : wrong)
    EXPECT_EQ(check_file(path, "// x\n" + line + "\n").size(), 1u) << path << ": " << line;
}

TEST(Layering, LeavesRightIncludesAlone) {
  const std::vector<std::pair<std::string, std::string>> right = {
      {"common/render/renderer.cpp", "#include \"common/strands/snapshot.h\""},
      {"common/gl/program.cpp", "#include <epoxy/gl.h>"},
      {"common/scene/scene_file.cpp", "#include \"strandcast/v1/scene.pb.h\""},
      {"server/net/beast_private.h", "#include <boost/beast.hpp>"},
      {"server/net/server.cpp", "#include \"server/net/beast_private.h\""},
      {"server/sim/solvers/dftl/dftl.cpp", "#include \"shaders/shared/bindings.h\""},
      {"server/encode/frame_worker.cpp", "#include \"server/publish/snapshot_slot.h\""},
      {"server/main.cpp", "#include \"server/app/app.h\""},
      {"common/replay/strand_replay.cpp", "#include <vector>"},
  };
  for (const auto& [path, line] : right) EXPECT_THAT(check_file(path, line + "\n"), IsEmpty());
}

}  // namespace
}  // namespace strandcast::layering_test
