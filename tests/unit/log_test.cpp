// The log: it never waits for its reader, survives its going away, and shows what strangers wrote as one
// line.
#include "common/log/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>

#include "common/log/line_writer.h"
#include "tests/support/log_capture.h"

namespace strandcast::log_test {
namespace {

/// A pipe of a few pages; each line may begin a page of its own.
class Pipe {
 public:
  Pipe() {
    EXPECT_EQ(pipe2(ends_.data(), O_CLOEXEC), 0);
    EXPECT_GT(fcntl(ends_[1], F_SETPIPE_SZ, 16'384), 0);
    EXPECT_EQ(fcntl(ends_[0], F_SETFL, O_NONBLOCK), 0);
  }
  ~Pipe() {
    close_reader();
    close(ends_[1]);
  }
  int writer() const { return ends_[1]; }
  void close_reader() {
    if (ends_[0] >= 0) close(ends_[0]);
    ends_[0] = -1;
  }
  std::string read_all() const {
    std::string text;
    std::array<char, 4'096> part{};
    for (ssize_t size = 0; (size = read(ends_[0], part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<size_t>(size));
    return text;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

TEST(LineWriter, LeavesOutWhatNobodyReadsAndSaysHowMuch) {
  const Pipe pipe;
  LineWriter writer(pipe.writer());
  constexpr uint64_t kLines = 10'000;
  for (uint64_t i = 0; i < kLines; ++i) writer.write(fmt::format("line {}\n", i));  // would wait for ever
  const std::string first = pipe.read_all();
  uint64_t whole = 0;
  std::string expected;
  while (expected.size() < first.size()) expected += fmt::format("line {}\n", whole++);
  EXPECT_EQ(first, expected) << "whole lines, in order";
  EXPECT_GT(whole, 0u);
  EXPECT_EQ(writer.dropped(), kLines - whole);
  writer.write("after\n");
  writer.write("later\n");
  EXPECT_EQ(pipe.read_all(),
            fmt::format("{} lines are missing here: nobody read the log\nafter\nlater\n", kLines - whole));
  EXPECT_EQ(writer.dropped(), kLines - whole);
}

TEST(LineWriter, DoesNotWriteWhereNobodyCanReadAnyMore) {
  Pipe pipe;
  LineWriter writer(pipe.writer());
  writer.write("read\n");
  pipe.close_reader();
  for (int i = 0; i < 3; ++i) writer.write("unread\n");  // would be SIGPIPE
  EXPECT_EQ(writer.dropped(), 3u);
}

TEST(LineWriter, CutsALineThatDoesNotFitAtOnce) {
  const Pipe pipe;
  LineWriter writer(pipe.writer());
  // Not sums of strings: GCC 12 warns of them at -O1.
  const std::string longest = fmt::format("{}\n", std::string(kMaxLogLineBytes - 1, 'a'));
  writer.write(longest);
  EXPECT_EQ(pipe.read_all(), longest) << "at the limit";
  writer.write(fmt::format("{}\n", std::string(kMaxLogLineBytes, 'a')));
  EXPECT_EQ(pipe.read_all(), fmt::format("{}...\n", std::string(kMaxLogLineBytes - 4, 'a'))) << "one over";
}

TEST(Log, AReaderThatGoesAwayEndsNoProgram) {
  EXPECT_EXIT(
      {
        Pipe pipe;
        dup2(pipe.writer(), STDERR_FILENO);
        init_log("info");
        pipe.close_reader();
        log_info("test", "unread");
        const bool is_lost = dropped_log_lines() == 1;
        const ssize_t written = write(STDERR_FILENO, "x", 1);  // by a library
        _exit(is_lost && written < 0 ? 7 : 1);
      },
      testing::ExitedWithCode(7), "");
}

// U+009B opens a control sequence as ESC [ does, U+202E turns what follows round, U+2028 ends a line.
TEST(Log, TextsOfStrangersStayOnOneLineAndShowThemselves) {
  const test::LogCapture capture;
  log_warn("net", "'{}'",
           "a\nerror [net] b\x1b[2J\xc2\x9b"
           "2J\xe2\x80\xae"
           "c\xe2\x80\xa8"
           "d\xff");
  ASSERT_EQ(capture.lines().size(), 1u);
  EXPECT_EQ(capture.lines()[0], "warning [net] 'a error [net] b [2J?2J?c?d?'");
  log_warn("net", "{}", std::string(100'000, 'x'));
  EXPECT_LE(capture.lines()[1].size(), kMaxLogMessageChars + 20);
}

// One object a line (RFC 8259): quotes and backslashes of strangers do not end its texts.
TEST(Log, AsJsonEveryLineIsOneObject) {
  EXPECT_EXIT(
      {
        init_log("info", LogFormat::Json);
        log_warn("net", "a \"name\" and a \\ from {}", "x\ny");
        _exit(0);
      },
      testing::ExitedWithCode(0),
      "^\\{\"time\":\"20[0-9-]*T[0-9:.]*Z\",\"level\":\"warning\",\"tag\":\"net\","
      "\"message\":\"a \\\\\"name\\\\\" and a \\\\\\\\ from x y\"\\}\n$");
}

}  // namespace
}  // namespace strandcast::log_test
