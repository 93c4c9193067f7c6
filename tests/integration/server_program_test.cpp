// strandcast-server as a person meets it: exit codes, one sentence on standard error, clean stop on a signal.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/record/recording_check.h"
#include "tests/support/eventually.h"
#include "tests/support/lacks_gl.h"
#include "tests/support/manager_socket.h"
#include "tests/support/raw_client.h"
#include "tests/support/sim_devices.h"
#include "tests/support/temporary_folder.h"

extern char** environ;

namespace strandcast::server_program_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class ServerProgram : public testing::Test {
 protected:
  /// Standard error goes to this descriptor, or to a file.
  pid_t spawn(std::vector<std::string> arguments, int error_descriptor = -1) {
    arguments.insert(arguments.begin(), program_);
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
    if (error_descriptor >= 0) posix_spawn_file_actions_adddup2(&actions, error_descriptor, 2);
    if (passed_ >= 0) posix_spawn_file_actions_adddup2(&actions, passed_, 3);
    pid_t process = -1;
    const int failed = posix_spawn(&process, program_.c_str(), &actions, nullptr, pointers.data(), environ);
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
  /// Starts a small server and waits until it listens; its port, 0 when it has ended.
  uint16_t serve(std::vector<std::string> arguments = {}, int error_descriptor = -1) {
    const std::filesystem::path port_path = folder_.path() / "port";
    arguments.insert(arguments.end(), {"--port", "0", "--port-file", port_path.string(), "--set",
                                       "groom.procedural.strand_count=50"});
    process_ = spawn(std::move(arguments), error_descriptor);
    bool has_ended = false;
    EXPECT_TRUE(eventually([&] {
      has_ended = waitpid(process_, nullptr, WNOHANG) == process_;
      return has_ended || std::filesystem::exists(port_path);
    }));
    return has_ended ? uint16_t{0} : static_cast<uint16_t>(std::stoi(text_of(port_path)));
  }
  std::string out() const { return text_of(folder_.path() / "out"); }
  std::string err() const { return text_of(folder_.path() / "err"); }

  TemporaryFolder folder_;
  std::string program_ = STRANDCAST_SERVER_PROGRAM;
  int passed_ = -1;  // becomes file descriptor 3 of what is spawned
  pid_t process_ = -1;
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
      {{"--viewer-mbit", "nan"}, "nan is not within"},
      {{"--viewer-mbit", "inf"}, "inf is not within"},
      {{"--viewer-mbit", "-1"}, "-1 is not within"},
      {{"--seconds", "nan"}, "nan is not within"},
      {{"--connections-per-s", "nan"}, "nan is not within"},
      {{"--messages-per-s", "1e9"}, "1e9 is not within"},
      {{"--max-sessions", "0"}, "0 is not within"},
      {{"--max-sessions", "257"}, "257 is not within"},
      {{"--handshake-ms", "99"}, "99 is not within"},
      {{"--trusted-proxy", "10.0.0.7/8"}, "10.0.0.7/8"},
      {{"--trusted-proxy", "proxy.example"}, "proxy.example"},
      {{"--proxy-protocol"}, "--trusted-proxy"},
      {{"--trusted-proxy", "10.0.0.7"}, "token"},
      {{"--token-file", "/no/such/token"}, "/no/such/token"},
      {{"--port", "0", "--gl-device", "nonsense"}, "nonsense"},
      {{"--port", "0", "--sim-device", "nonsense"}, "nonsense"},
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
  EXPECT_THAT(out(), HasSubstr("Viewers of strands get step where"));
  EXPECT_THAT(out(), HasSubstr(", else tangent; "));
}

// A scene takes seconds to be built: what cannot be served is said before.
TEST_F(ServerProgram, SaysThatThePortIsInUseBeforeItBuildsTheScene) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(own);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&own), size), 0);
  ASSERT_EQ(listen(listener, 1), 0);
  ASSERT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&own), &size), 0);
  EXPECT_EQ(run({"--port", std::to_string(ntohs(own.sin_port)), "--gl-device", "nonsense"}), 2);
  EXPECT_THAT(err(), HasSubstr("is in use by another program"));
  close(listener);
}

/// Whether a process handles SIGTERM by itself already.
bool is_terminable(pid_t process) {
  std::ifstream status(fmt::format("/proc/{}/status", process));
  constexpr uint64_t kBit = uint64_t{1} << (SIGTERM - 1);
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigBlk:")) return (std::stoull(line.substr(7), nullptr, 16) & kBit) != 0;
  return false;
}

TEST_F(ServerProgram, EndsAtOnceWhileItStillBuildsItsScene) {
  const pid_t process = spawn({"--port", "0", "--set", "groom.procedural.strand_count=60000"});
  ASSERT_TRUE(eventually([&] { return is_terminable(process); }));
  ASSERT_EQ(kill(process, SIGTERM), 0);
  EXPECT_EQ(wait(process), 0);
  EXPECT_THAT(err(), HasSubstr("stopped before it served"));
}

TEST_F(ServerProgram, PrintsNothingIntoARecordingWhereItsOutputsAreClosed) {
  const std::filesystem::path recording = folder_.path() / "run.mcap";
  program_ = "/bin/sh";
  const uint16_t port = serve({"-c", fmt::format("exec {} \"$@\" <&- >&- 2>&-", STRANDCAST_SERVER_PROGRAM),
                               "sh", "--record", recording.string(), "--log-level", "info"});
  if (port == 0 && test::lacks_gl(err())) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  ASSERT_NE(port, 0);
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_EQ(wait(process_), 0);
  const auto check = check_recording(recording);
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_TRUE(check->is_sound()) << testing::PrintToString(check->problems);
}

TEST_F(ServerProgram, ServesUntilTerminated) {
  const uint16_t port = serve({"--log-level", "off"});
  if (port == 0 && test::lacks_gl(err())) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  ASSERT_NE(port, 0) << err();
  EXPECT_THAT(test::http_get(port, "/healthz"), HasSubstr("ok"));
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_EQ(wait(process_), 0) << err();
}

// Whatever simulates, it is said, and strands move. What needs no OpenGL does without any driver for it.
TEST_F(ServerProgram, SaysWhatSimulates) {
  for (const SimDevice device : sim_devices()) {
    const std::string name = to_string(device);
    SCOPED_TRACE(name);
    if (device != SimDevice::Gl) setenv("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent", 1);
    const uint16_t port = serve({"--sim-device", name, "--log-level", "info"});
    unsetenv("__EGL_VENDOR_LIBRARY_DIRS");
    ASSERT_NE(port, 0) << err();
    EXPECT_THAT(err(), HasSubstr("simulating on "));
    const auto metrics = [&] { return test::http_get(port, "/metrics"); };
    EXPECT_TRUE(eventually([&] {
      return metrics().find("sim_device_info{device=\"" + name) != std::string::npos;
    })) << metrics();
    EXPECT_TRUE(
        eventually([&] { return metrics().find("\nstrandcast_sim_steps_total 0\n") == std::string::npos; }));
    test::RawClient client(port);
    ASSERT_TRUE(client.handshake());
    client.send(Hello{});
    const auto welcome = client.read_control<Welcome>();
    ASSERT_TRUE(welcome);
    EXPECT_FALSE(welcome->sim_device.empty());
    EXPECT_THAT(err(), HasSubstr("simulating on " + welcome->sim_device));
    ASSERT_EQ(kill(process_, SIGTERM), 0);
    EXPECT_EQ(wait(process_), 0) << err();
    std::filesystem::remove(folder_.path() / "port");
  }
}

// As systemd has it with Type=notify, WatchdogSec= and a .socket unit.
TEST_F(ServerProgram, TellsItsManagerAndTakesItsSocket) {
  test::ManagerSocket manager(folder_.path() / "manager");
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(own);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&own), size), 0);
  ASSERT_EQ(listen(listener, 8), 0);
  ASSERT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&own), &size), 0);
  // A shell stands for the manager: only the process itself can know its number beforehand.
  program_ = "/bin/sh";
  const std::string script = fmt::format(
      "export LISTEN_PID=$$ LISTEN_FDS=1 LISTEN_FDNAMES=strandcast WATCHDOG_PID=$$ WATCHDOG_USEC=1000000 "
      "NOTIFY_SOCKET={}; exec {} \"$@\"",
      (folder_.path() / "manager").string(), STRANDCAST_SERVER_PROGRAM);
  passed_ = listener;
  const uint16_t port = serve({"-c", script, "sh", "--log-level", "off"});
  if (port == 0 && test::lacks_gl(err())) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  close(listener);
  EXPECT_EQ(port, ntohs(own.sin_port)) << err();
  EXPECT_TRUE(manager.hears("READY=1\nSTATUS=Serving 'default' on 127.0.0.1 port ")) << err();
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_THAT(test::http_get(port, "/healthz"), HasSubstr("ok"));
  test::RawClient client(port);
  ASSERT_TRUE(client.handshake());
  client.send(Hello{});
  EXPECT_TRUE(manager.hears(", 1 viewer\n"));
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
  EXPECT_EQ(wait(process_), 0) << err();
}

// What `systemctl reload` sends, whether or not there is a certificate to read again.
TEST_F(ServerProgram, AReloadIsNoEnd) {
  const uint16_t port = serve();
  if (port == 0 && test::lacks_gl(err())) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  ASSERT_NE(port, 0) << err();
  ASSERT_EQ(kill(process_, SIGHUP), 0);
  EXPECT_TRUE(eventually([&] { return err().find("no certificate") != std::string::npos; })) << err();
  EXPECT_THAT(test::http_get(port, "/healthz"), HasSubstr("ok"));
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_EQ(wait(process_), 0) << err();
}

// Tokens that nobody saw are not made for a file that is gone: those of before go on.
TEST_F(ServerProgram, AReloadWithoutItsTokenFileChangesNothing) {
  const std::filesystem::path tokens = folder_.path() / "tokens";
  std::ofstream(tokens) << "viewer 0123456789abcdef\n";
  std::filesystem::permissions(tokens, std::filesystem::perms::owner_read);
  const uint16_t port = serve({"--token-file", tokens.string(), "--sim-device", "lanes"});
  ASSERT_NE(port, 0) << err();
  std::filesystem::remove(tokens);
  ASSERT_EQ(kill(process_, SIGHUP), 0);
  EXPECT_TRUE(eventually([&] { return err().find("the old tokens stay") != std::string::npos; })) << err();
  EXPECT_FALSE(std::filesystem::exists(tokens));
  EXPECT_THAT(out(), Not(HasSubstr("New tokens")));
  test::RawClient client(port);
  ASSERT_TRUE(client.handshake());
  Hello hello;
  hello.token = "0123456789abcdef";
  client.send(hello);
  EXPECT_TRUE(client.read_control<Welcome>());
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_EQ(wait(process_), 0) << err();
}

/// So many sessions, one after the other; each leaves two lines in the log.
void join_and_leave(uint16_t port, int count) {
  for (int i = 0; i < count; ++i) {
    test::RawClient client(port);
    ASSERT_TRUE(client.handshake()) << i;
    client.send(Hello{});
    ASSERT_TRUE(client.read_control<Welcome>()) << i;
  }
}

TEST_F(ServerProgram, ALogThatNobodyReadsStopsNothing) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  ASSERT_GT(fcntl(ends[1], F_SETPIPE_SZ, 4'096), 0);
  const uint16_t port = serve({}, ends[1]);
  close(ends[1]);
  std::string log(4'096, '\0');
  if (port == 0) log.resize(static_cast<size_t>(std::max<ssize_t>(read(ends[0], log.data(), log.size()), 0)));
  if (port == 0 && test::lacks_gl(log)) GTEST_SKIP() << "needs OpenGL 4.5: " << log;
  ASSERT_NE(port, 0) << log;
  join_and_leave(port, 100);  // some 10,000 bytes
  EXPECT_THAT(test::http_get(port, "/metrics"), AllOf(HasSubstr("\nstrandcast_log_dropped_lines_total"),
                                                      Not(HasSubstr("log_dropped_lines_total 0\n"))));
  close(ends[0]);  // now nobody can read it any more
  join_and_leave(port, 10);
  EXPECT_THAT(test::http_get(port, "/healthz"), HasSubstr("ok"));
  ASSERT_EQ(kill(process_, SIGTERM), 0);
  EXPECT_EQ(wait(process_), 0);
}

/// The names in one of systemd's groups of system calls, groups in groups included.
std::set<std::string> calls_in(const std::string& group) {
  const std::unique_ptr<FILE, decltype(&pclose)> pipe(
      popen(("systemd-analyze syscall-filter " + group + " 2>/dev/null").c_str(), "r"), pclose);
  std::set<std::string> calls;
  std::array<char, 256> line{};
  while (pipe && std::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
    std::istringstream words(line.data());
    std::string word;
    if (!(words >> word) || word.front() == '#' || word == group) continue;
    if (word.front() == '@')
      calls.merge(calls_in(word));
    else
      calls.insert(word);
  }
  return calls;
}

// The frame thread would ask in vain to stand behind the simulation, and workers behind other programs.
TEST_F(ServerProgram, TheUnitAllowsWhatTheServerCalls) {
  const std::set<std::string> service = calls_in("@system-service");
  if (service.empty()) GTEST_SKIP() << "systemd-analyze is not installed, which knows the groups of calls";
  std::set<std::string> allowed;
  std::istringstream unit(
      text_of(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy/strandcast-server.service"));
  for (std::string line; std::getline(unit, line);) {
    constexpr std::string_view kKey = "SystemCallFilter=";
    if (!line.starts_with(kKey)) continue;
    const bool is_denied = line[kKey.size()] == '~';
    std::istringstream words(line.substr(kKey.size() + (is_denied ? 1 : 0)));
    for (std::string word; words >> word;) {
      const std::set<std::string> calls = word.front() == '@' ? calls_in(word) : std::set<std::string>{word};
      for (const std::string& call : calls)
        is_denied ? (void)allowed.erase(call) : (void)allowed.insert(call);
    }
  }
  for (const char* call : {"setpriority", "getpriority", "gettid", "futex", "poll", "sendmsg", "accept4",
                           "rt_sigtimedwait", "clone3"})
    EXPECT_TRUE(allowed.contains(call)) << call;
  for (const char* call : {"mount", "ptrace", "setuid", "sched_setscheduler"})
    EXPECT_FALSE(allowed.contains(call)) << call;
}

TEST_F(ServerProgram, LeavesAfterTheGivenTime) {
  const int code = run({"--port", "0", "--seconds", "0.2", "--set", "groom.procedural.strand_count=50"});
  if (code == 2 && test::lacks_gl(err())) GTEST_SKIP() << "needs OpenGL 4.5: " << err();
  EXPECT_EQ(code, 0) << err();
}

}  // namespace
}  // namespace strandcast::server_program_test
