// strandcast-server as a person meets it: exit codes, one sentence on standard error, clean stop on a signal.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/eventually.h"
#include "tests/support/raw_client.h"
#include "tests/support/temporary_folder.h"

extern char** environ;

namespace strandcast {
namespace {

using testing::HasSubstr;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class ServerProgram : public testing::Test {
 protected:
  pid_t spawn(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), STRANDCAST_SERVER_PROGRAM);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const auto redirect = [&](int descriptor, const std::filesystem::path& path) {
      posix_spawn_file_actions_addopen(&actions, descriptor, path.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                       0600);
    };
    redirect(1, folder_.path() / "out");
    redirect(2, folder_.path() / "err");
    pid_t process = -1;
    const int failed =
        posix_spawn(&process, STRANDCAST_SERVER_PROGRAM, &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    EXPECT_EQ(failed, 0);
    return process;
  }
  static int wait(pid_t process) {
    int status = 0;
    EXPECT_EQ(waitpid(process, &status, 0), process);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  int run(std::vector<std::string> arguments) { return wait(spawn(std::move(arguments))); }
  std::string out() const { return text_of(folder_.path() / "out"); }
  std::string err() const { return text_of(folder_.path() / "err"); }

  TemporaryFolder folder_;
};

TEST_F(ServerProgram, BadInputIsExitCodeTwoAndOneSentence) {
  std::ofstream(folder_.path() / "bad.textproto") << "name: 'x'\nnonsense: 3\n";
  std::ofstream(folder_.path() / "short.tfx") << "not a groom";
  const std::string bad_scene = (folder_.path() / "bad.textproto").string();
  std::ofstream(folder_.path() / "stiff.textproto")
      << "name: 'x'\nsolver { name: 'mass_spring' parameters { key: "
         "'integrator' value: 0 } }\n";
  const std::string stiff_scene = (folder_.path() / "stiff.textproto").string();
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--nonsense"}, "nonsense"},
      {{"--scene", "/no/such/scene.textproto"}, "/no/such/scene.textproto"},
      {{"--scene", bad_scene}, "nonsense"},
      {{"--set", "solver.name=spaghetti"}, "known: dftl"},
      {{"--scene", stiff_scene}, "times as many substeps"},
      {{"--explain", "--scene", stiff_scene}, "or integrator 2"},
      {{"--set", "substeps=0"}, "substeps"},
      {{"--groom", "/no/such/hair.tfx"}, "/no/such/hair.tfx"},
      {{"--groom", (folder_.path() / "short.tfx").string()}, "short.tfx"},
      {{"--listen", "0.0.0.0"}, "token"},
      {{"--listen", "nonsense"}, "nonsense"},
      {{"--port", "99999"}, "99999"},
      {{"--token-file", "/no/such/token"}, "/no/such/token"},
      {{"--port", "0", "--gl-device", "nonsense"}, "nonsense"},
      {{"--explain", bad_scene}, "nonsense"}};
  for (const auto& [arguments, part] : cases) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--log-level", "off"});
    EXPECT_EQ(run(all), 2) << arguments[0] << " " << arguments.back();
    const std::string text = err();
    EXPECT_THAT(text, HasSubstr(part));
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    EXPECT_EQ(out(), "");
  }
}

TEST_F(ServerProgram, PrintsSolversSceneAndPlan) {
  EXPECT_EQ(run({"--list-solvers"}), 0);
  EXPECT_THAT(out(), HasSubstr("dftl"));
  EXPECT_EQ(run({"--print-scene", "--set", "substeps=3"}), 0);
  EXPECT_THAT(out(), HasSubstr("substeps: 3"));
  // What it printed is a scene again.
  std::ofstream(folder_.path() / "printed.textproto") << out();
  EXPECT_EQ(run({"--print-scene", "--scene", (folder_.path() / "printed.textproto").string()}), 0);
  EXPECT_EQ(run({"--explain", "--set", "wind.gust_intensity=0", "--log-level", "off"}), 0);
  EXPECT_THAT(out(), HasSubstr("scene/gusts        not requested"));
}

TEST_F(ServerProgram, ServesUntilTerminated) {
  const std::filesystem::path port_path = folder_.path() / "port";
  const pid_t process = spawn({"--port", "0", "--port-file", port_path.string(), "--set",
                               "groom.procedural.strand_count=50", "--log-level", "off"});
  int status = 0;
  bool has_ended = false;
  const bool is_ready = eventually([&] {
    has_ended = waitpid(process, &status, WNOHANG) == process;
    return has_ended || std::filesystem::exists(port_path);
  });
  ASSERT_TRUE(is_ready);
  if (has_ended && err().find("EGL") != std::string::npos) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  ASSERT_FALSE(has_ended) << err();
  const auto port = static_cast<uint16_t>(std::stoi(text_of(port_path)));
  EXPECT_THAT(test::http_get(port, "/healthz"), HasSubstr("ok"));
  ASSERT_EQ(kill(process, SIGTERM), 0);
  EXPECT_EQ(wait(process), 0) << err();
}

TEST_F(ServerProgram, LeavesAfterTheGivenTime) {
  const int code = run({"--port", "0", "--seconds", "0.2", "--set", "groom.procedural.strand_count=50"});
  if (code == 2 && err().find("EGL") != std::string::npos) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  EXPECT_EQ(code, 0) << err();
}

}  // namespace
}  // namespace strandcast
