// What a service manager is told and what it passes, against the words of sd_notify(3) and sd_listen_fds(3).
#include "server/app/service_manager.h"
#include "common/base/units.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>

#include <cstdlib>
#include <map>

#include "tests/support/manager_socket.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::service_manager_test {
namespace {

using testing::HasSubstr;

/// Variables of the environment for the time of a test.
class Environment {
 public:
  explicit Environment(const std::map<std::string, std::string>& variables) : variables_(variables) {
    for (const auto& [name, value] : variables_) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : variables_) unsetenv(name.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

std::string own_id() {
  return std::to_string(getpid());
}

class ServiceManagerTest : public testing::Test {
 protected:
  std::string path() const { return (folder_.path() / "manager").string(); }

  TemporaryFolder folder_;
  test::ManagerSocket heard_{folder_.path() / "manager"};
};

TEST_F(ServiceManagerTest, TellsThatItIsReadyHowItGoesAndThatItStops) {
  const Environment environment({{"NOTIFY_SOCKET", path()}});
  ServiceManager manager = ServiceManager::of_environment();
  EXPECT_TRUE(manager.is_there());
  manager.tell_ready("Serving");
  EXPECT_EQ(heard_.next(), "READY=1\nSTATUS=Serving\n");
  manager.tell_status("Serving");  // is known
  manager.tell_status("Serving 1 viewer");
  EXPECT_EQ(heard_.next(), "STATUS=Serving 1 viewer\n");
  manager.tell_stopping();
  EXPECT_THAT(heard_.next(), HasSubstr("STOPPING=1\n"));
}

TEST_F(ServiceManagerTest, BeatsTwiceWithinItsTimeUnlessTheSimulationHangs) {
  const Environment environment(
      {{"NOTIFY_SOCKET", path()}, {"WATCHDOG_USEC", "10000000"}, {"WATCHDOG_PID", own_id()}});
  ServiceManager manager = ServiceManager::of_environment();
  manager.beat(100 * kSInNs, 0);
  EXPECT_EQ(heard_.next(), "WATCHDOG=1\n");
  manager.beat(104 * kSInNs, 0);  // not yet
  manager.beat(106 * kSInNs, 6 * kSInNs);
  EXPECT_EQ(heard_.next(0), "");
  manager.beat(107 * kSInNs, kSInNs);
  EXPECT_EQ(heard_.next(), "WATCHDOG=1\n");
}

TEST_F(ServiceManagerTest, IsSilentWhereNobodyAsksIt) {
  {
    ServiceManager nobody = ServiceManager::of_environment();
    EXPECT_FALSE(nobody.is_there());
    nobody.tell_ready("Serving");
  }
  const Environment environment(
      {{"NOTIFY_SOCKET", path()}, {"WATCHDOG_USEC", "10000000"}, {"WATCHDOG_PID", "1"}});
  ServiceManager other = ServiceManager::of_environment();
  other.beat(100 * kSInNs, 0);  // another process is watched
  EXPECT_EQ(heard_.next(0), "");
  for (const std::string& address : {std::string("vsock:2:1234"), std::string("/") + std::string(200, 'x')}) {
    const Environment wrong({{"NOTIFY_SOCKET", address}});
    ServiceManager::of_environment().tell_ready("Serving");
  }
}

/// A listening socket, or another one, as file descriptor 3, where a manager puts it. Restores what was
/// there.
class PassedDescriptor {
 public:
  explicit PassedDescriptor(bool is_listening, int type = SOCK_STREAM) : before_(dup(3)) {
    const int made = socket(AF_INET, type, 0);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(made, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0);
    if (is_listening) {
      EXPECT_EQ(listen(made, 1), 0);
    }
    socklen_t size = sizeof(own);
    getsockname(made, reinterpret_cast<sockaddr*>(&own), &size);
    port_ = ntohs(own.sin_port);
    if (made != 3) {
      EXPECT_EQ(dup2(made, 3), 3);
      close(made);
    }
  }
  ~PassedDescriptor() {
    close(3);
    if (before_ < 0) return;
    dup2(before_, 3);
    close(before_);
  }
  PassedDescriptor(const PassedDescriptor&) = delete;
  PassedDescriptor& operator=(const PassedDescriptor&) = delete;
  uint16_t port() const { return port_; }

 private:
  int before_;
  uint16_t port_ = 0;
};

TEST(PassedSocketTest, IsTheOneOfOurName) {
  const PassedDescriptor passed(true);
  for (const char* names : {"strandcast", "strandcast:other"}) {
    const Environment environment({{"LISTEN_PID", own_id()}, {"LISTEN_FDS", "1"}, {"LISTEN_FDNAMES", names}});
    const auto taken = take_passed_socket();
    ASSERT_TRUE(taken) << taken.error().to_string();
    ASSERT_TRUE(*taken);
    EXPECT_EQ((*taken)->descriptor, 3);
    EXPECT_EQ((*taken)->address, "127.0.0.1");
    EXPECT_EQ((*taken)->port, passed.port());
    EXPECT_EQ(fcntl(3, F_GETFD), FD_CLOEXEC);
    EXPECT_EQ(getenv("LISTEN_FDS"), nullptr);
  }
  const Environment without_names({{"LISTEN_PID", own_id()}, {"LISTEN_FDS", "1"}});
  const auto taken = take_passed_socket();
  ASSERT_TRUE(taken);
  EXPECT_TRUE(*taken);
}

TEST(PassedSocketTest, OfAnotherProcessOrNoneIsNone) {
  const auto none = take_passed_socket();
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  const Environment environment({{"LISTEN_PID", "1"}, {"LISTEN_FDS", "1"}});
  const auto of_another = take_passed_socket();
  ASSERT_TRUE(of_another);
  EXPECT_FALSE(*of_another);
}

TEST(PassedSocketTest, OtherSocketsAreRefusedWithWhatToWrite) {
  const auto refused = [](const char* count, const char* names) {
    const Environment environment(
        {{"LISTEN_PID", own_id()}, {"LISTEN_FDS", count}, {"LISTEN_FDNAMES", names}});
    const auto taken = take_passed_socket();
    return taken ? std::string("taken") : taken.error().to_string();
  };
  {
    const PassedDescriptor passed(true);
    EXPECT_THAT(refused("1", "web"), HasSubstr("FileDescriptorName=strandcast"));
    EXPECT_THAT(refused("1", "other:strandcast"), HasSubstr("FileDescriptorName=strandcast"));
    EXPECT_THAT(refused("1000", "strandcast"), HasSubstr("at most 16"));
  }
  {
    const PassedDescriptor passed(false);
    EXPECT_THAT(refused("1", "strandcast"), HasSubstr("ListenStream=ADDRESS:PORT"));
  }
  const PassedDescriptor passed(false, SOCK_DGRAM);
  EXPECT_THAT(refused("1", "strandcast"), HasSubstr("no listening TCP socket"));
}

}  // namespace
}  // namespace strandcast::service_manager_test
