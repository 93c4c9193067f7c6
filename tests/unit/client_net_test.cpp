#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "common/base/file.h"
#include "common/client/address.h"
#include "common/client/mailbox.h"
#include "common/client/reconnect_policy.h"
#include "common/client/viewer_client.h"
#include "common/wire/close_code.h"
#include "common/wire/messages.h"

namespace strandcast::client_net_test {
namespace {

using std::chrono::milliseconds;

MediaEvent media(Opcode opcode, uint32_t sequence, size_t size_bytes = 100) {
  MediaEvent event;
  event.header.opcode = opcode;
  event.header.sequence = sequence;
  event.message.resize(size_bytes);
  return event;
}

std::vector<uint32_t> sequences(const std::vector<ClientEvent>& events, Opcode opcode) {
  std::vector<uint32_t> found;
  for (const ClientEvent& event : events)
    if (const auto* part = std::get_if<MediaEvent>(&event); part && part->header.opcode == opcode)
      found.push_back(part->header.sequence);
  return found;
}

TEST(Mailbox, KeepsEveryStrandFrameInOrderAndOnlyTheNewestPicture) {
  Mailbox mailbox;
  mailbox.push(media(Opcode::StrandKeyframe, 1));
  mailbox.push(media(Opcode::JpegFrame, 7));
  mailbox.push(media(Opcode::StrandDelta, 2));
  mailbox.push(media(Opcode::JpegFrame, 8));
  mailbox.push(media(Opcode::StrandDelta, 3));
  const auto events = mailbox.take();
  EXPECT_EQ(sequences(events, Opcode::StrandDelta), (std::vector<uint32_t>{2, 3}));
  EXPECT_EQ(sequences(events, Opcode::JpegFrame), (std::vector<uint32_t>{8}));
  EXPECT_EQ(events.size(), 4u);
  EXPECT_TRUE(mailbox.take().empty());
  EXPECT_EQ(mailbox.dropped_frames(), 0u);
}

TEST(Mailbox, PicturesThatBuildOnEachOtherKeepTheirOrderAndTheirBound) {
  Mailbox mailbox({.chained_frames = 3});
  const auto chained = [](Opcode opcode, uint32_t sequence) {
    MediaEvent event = media(opcode, sequence);
    event.header.base_sequence = sequence - 1;
    return event;
  };
  for (uint32_t i = 1; i <= 3; ++i) {
    EXPECT_EQ(mailbox.push(chained(Opcode::JpegTiles, i)), Mailbox::Outcome::Kept);
    EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, i)), Mailbox::Outcome::Kept) << "counted apart";
  }
  EXPECT_EQ(mailbox.push(chained(Opcode::JpegTiles, 4)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_EQ(mailbox.push(chained(Opcode::JpegTiles, 5)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_EQ(mailbox.push(chained(Opcode::JpegTiles, 1)), Mailbox::Outcome::Kept) << "base 0: a whole one";
  EXPECT_EQ(mailbox.push(chained(Opcode::JpegTiles, 2)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.dropped_frames(), 5u);
  const auto events = mailbox.take();
  EXPECT_EQ(sequences(events, Opcode::JpegTiles), (std::vector<uint32_t>{1, 2}));
  EXPECT_EQ(sequences(events, Opcode::StrandDelta), (std::vector<uint32_t>{1, 2, 3}));
}

TEST(Mailbox, DropsAllStrandFramesOnOverflowUntilTheNextKeyframe) {
  Mailbox mailbox({.chained_frames = 3});
  EXPECT_EQ(mailbox.push(media(Opcode::StrandKeyframe, 1)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 2)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 3)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 4)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 5)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_TRUE(mailbox.take().empty());
  // Emptied in between: a delta still has no base.
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 6)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandKeyframe, 7)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 8)), Mailbox::Outcome::Kept);
  EXPECT_EQ(mailbox.take().size(), 2u);
  EXPECT_EQ(mailbox.dropped_frames(), 6u);
}

TEST(Mailbox, StaysWithinItsByteLimitAndLetsAKeyframeStartAfresh) {
  Mailbox mailbox({.chained_bytes = 1000});
  mailbox.push(media(Opcode::StrandKeyframe, 1, 600));
  mailbox.push(media(Opcode::StrandDelta, 2, 400));
  EXPECT_EQ(mailbox.push(media(Opcode::StrandKeyframe, 3, 700)), Mailbox::Outcome::Kept);
  const auto events = mailbox.take();
  EXPECT_EQ(sequences(events, Opcode::StrandKeyframe), (std::vector<uint32_t>{3}));
  EXPECT_EQ(events.size(), 1u);
  EXPECT_EQ(mailbox.dropped_frames(), 2u);
}

TEST(Mailbox, BoundsStatusAndNotices) {
  Mailbox mailbox({.notices = 4});
  for (uint64_t i = 0; i < 100; ++i) {
    mailbox.push(ServerStatus{.tick = i});
    mailbox.push(Notice{false, std::to_string(i)});
  }
  const auto events = mailbox.take();
  ASSERT_EQ(events.size(), 5u);
  std::vector<std::string> notices;
  for (const auto& event : events) {
    if (const auto* status = std::get_if<ServerStatus>(&event)) {
      EXPECT_EQ(status->tick, 99u);
    }
    if (const auto* notice = std::get_if<Notice>(&event)) notices.push_back(notice->text);
  }
  EXPECT_EQ(notices, (std::vector<std::string>{"96", "97", "98", "99"}));
}

TEST(Mailbox, OfLooksOnlyTheNewestWaits) {
  Mailbox mailbox;
  LookChange look;
  for (int i = 1; i <= 100; ++i) {
    look.look.exposure = static_cast<float>(i);
    mailbox.push(look);
    mailbox.push(SceneText{std::to_string(i)});
  }
  const auto events = mailbox.take();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(std::get<LookChange>(events[0]).look.exposure, 100.0f);
  EXPECT_EQ(std::get<SceneText>(events[1]).text, "100");
}

TEST(Mailbox, GivesOneEventAtATimeAndBoundsTheRest) {
  Mailbox mailbox({.chained_frames = 3});
  const auto next_sequence = [&]() -> uint32_t {
    const auto event = mailbox.next(milliseconds(0));
    const auto* part = event ? std::get_if<MediaEvent>(&*event) : nullptr;
    return part ? part->header.sequence : 0;
  };
  EXPECT_FALSE(mailbox.next(milliseconds(1)));
  mailbox.push(media(Opcode::StrandKeyframe, 1));
  for (uint32_t i = 2; i <= 3; ++i)
    EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, i)), Mailbox::Outcome::Kept);
  EXPECT_EQ(next_sequence(), 1u);
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 4)), Mailbox::Outcome::Kept) << "one has left";
  EXPECT_EQ(mailbox.push(media(Opcode::StrandDelta, 5)), Mailbox::Outcome::KeyframeNeeded);
  EXPECT_EQ(next_sequence(), 0u) << "what cannot be used is gone";
  mailbox.push(media(Opcode::StrandKeyframe, 6));
  mailbox.push(ServerStatus{.tick = 1});
  mailbox.push(media(Opcode::JpegFrame, 7));
  mailbox.push(ServerStatus{.tick = 2});
  EXPECT_EQ(next_sequence(), 6u);
  EXPECT_EQ(next_sequence(), 7u);
  const auto status = mailbox.next(milliseconds(0));
  ASSERT_TRUE(status);
  EXPECT_EQ(std::get<ServerStatus>(*status).tick, 2u);
  EXPECT_FALSE(mailbox.next(milliseconds(0)));
}

// What was taken out is no longer counted, one by one or all at once.
TEST(Mailbox, WhoKeepsUpLosesNothingHoweverMuchComes) {
  constexpr size_t kFrameBytes = 400;
  Mailbox mailbox({.chained_bytes = 1'000});
  for (uint32_t i = 1; i <= 50; ++i) {
    EXPECT_EQ(mailbox.push(media(i == 1 ? Opcode::StrandKeyframe : Opcode::StrandDelta, i, kFrameBytes)),
              Mailbox::Outcome::Kept)
        << i;
    if (i % 2 == 0) {
      EXPECT_EQ(mailbox.take().size(), 1u);
    } else {
      EXPECT_TRUE(mailbox.next(milliseconds(0)).has_value());
      mailbox.push(media(Opcode::StrandDelta, 1'000 + i, kFrameBytes));
      EXPECT_TRUE(mailbox.next(milliseconds(0)).has_value());
    }
  }
  EXPECT_EQ(mailbox.dropped_frames(), 0u);
}

TEST(Outbox, HoldsSoManyBytesAtOnceAndAnyNumberInTurn) {
  Outbox outbox;
  const std::vector<std::byte> half(kMaxSendQueueBytes / 2);
  for (int turn = 0; turn < 4; ++turn) {
    EXPECT_TRUE(outbox.push(half));
    EXPECT_TRUE(outbox.push(half));
    EXPECT_EQ(outbox.push({std::byte{1}}).error().code, ErrorCode::LimitExceeded);
    EXPECT_EQ(outbox.message_count(), 2u);
    outbox.pop();
    outbox.pop();
  }
  for (size_t i = 0; i < kMaxSendQueueMessages; ++i) EXPECT_TRUE(outbox.push({}));
  EXPECT_EQ(outbox.push({}).error().code, ErrorCode::LimitExceeded);
  outbox.close();
  EXPECT_EQ(outbox.push({}).error().code, ErrorCode::Unavailable);
}

TEST(Mailbox, EndsWithOneClosedEvent) {
  Mailbox mailbox;
  mailbox.close(make_error(ErrorCode::Timeout, "first"));
  mailbox.close(make_error(ErrorCode::Internal, "second"));
  mailbox.push(media(Opcode::StrandKeyframe, 1));
  mailbox.push(ServerStatus{});
  const auto events = mailbox.take();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(std::get<ClosedEvent>(events[0]).error.message, "first");
}

TEST(Mailbox, WaitWakesForAnEventAndGivesUpAfterTheTimeout) {
  Mailbox mailbox;
  EXPECT_TRUE(mailbox.wait(milliseconds(1)).empty());
  std::thread sender([&mailbox] { mailbox.push(ServerStatus{.tick = 5}); });
  EXPECT_EQ(mailbox.wait(std::chrono::minutes(1)).size(), 1u);
  sender.join();
}

constexpr int64_t kMsNs = 1'000'000;

TEST(ReconnectPolicy, DoublesFromAQuarterSecondToAHalfAndForALongOutageToFiveWithJitter) {
  ReconnectPolicy policy(1);
  const Error lost = make_error(ErrorCode::Unavailable, "connection lost");
  double nominal_ms = 250.0;
  for (uint32_t i = 0; i < kUrgentAttempts + 5; ++i) {
    if (i == kUrgentAttempts) nominal_ms = 5000.0;
    const auto delay = policy.on_lost(lost, i * kMsNs);
    ASSERT_TRUE(delay);
    EXPECT_GE(delay->count(), nominal_ms * (1.0 - kReconnectJitter) - 1.0) << "attempt " << i;
    EXPECT_LE(delay->count(), nominal_ms * (1.0 + kReconnectJitter)) << "attempt " << i;
    nominal_ms = std::min(nominal_ms * 2.0, i < kUrgentAttempts ? 500.0 : 5000.0);
  }
  ReconnectPolicy urgent(1, kLongestUrgentDelay);
  for (uint32_t i = 0; i < kUrgentAttempts + 5; ++i)
    EXPECT_LE(urgent.on_lost(lost, i * kMsNs)->count(), 625) << "others wait";
}

TEST(ReconnectPolicy, StartsOverOnlyAfterAConnectionThatLasted) {
  ReconnectPolicy policy(2);
  const Error lost = make_error(ErrorCode::Timeout, "nothing received");
  int64_t time_ns = kMsNs;
  const auto delay_after = [&](int64_t lived_ms) {
    policy.on_welcome(time_ns);
    time_ns += lived_ms * kMsNs;
    return policy.on_lost(lost, time_ns)->count();
  };
  for (uint32_t i = 0; i < kUrgentAttempts; ++i) (void)delay_after(100);
  EXPECT_GT(delay_after(100), 3000);
  EXPECT_LT(delay_after(kStableConnection.count()), 400);
}

TEST(ReconnectPolicy, SpreadsManyViewers) {
  std::set<int64_t> delays;
  const Error lost = make_error(ErrorCode::Unavailable, "connection lost");
  for (uint32_t seed = 0; seed < 50; ++seed)
    delays.insert(ReconnectPolicy(seed).on_lost(lost, kMsNs)->count());
  EXPECT_GT(delays.size(), 25u);
}

TEST(ReconnectPolicy, AddsUpHowLongTheServerWasAway) {
  ReconnectPolicy policy(1);
  const Error lost = make_error(ErrorCode::Timeout, "nothing received");
  (void)policy.on_lost(lost, 500 * kMsNs);
  EXPECT_EQ(policy.outage_s(900 * kMsNs), 0.0) << "nobody has been there yet";
  policy.on_welcome(1'000 * kMsNs);
  EXPECT_EQ(policy.reconnects(), 0u);
  (void)policy.on_lost(lost, 20'000 * kMsNs, 5'000 * kMsNs);  // silent for 15 s
  EXPECT_NEAR(policy.outage_s(21'000 * kMsNs), 16.0, 1e-9) << "it goes on";
  (void)policy.on_lost(lost, 21'000 * kMsNs);
  policy.on_welcome(22'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(30'000 * kMsNs), 17.0, 1e-9);
  (void)policy.on_lost(lost, 30'000 * kMsNs);
  policy.on_welcome(31'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(40'000 * kMsNs), 18.0, 1e-9);
  EXPECT_EQ(policy.reconnects(), 2u);
  EXPECT_NEAR(policy.since_first_s(40'000 * kMsNs), 39.0, 1e-9);
}

TEST(ReconnectPolicy, ASilenceIsDoubtedAndThreeSecondsOfItAreNoConnection) {
  EXPECT_FALSE(is_doubted(1'000 * kMsNs, 2'499 * kMsNs));
  EXPECT_TRUE(is_doubted(1'000 * kMsNs, 2'500 * kMsNs));
  EXPECT_FALSE(is_silent(1'000 * kMsNs, 3'999 * kMsNs));
  EXPECT_TRUE(is_silent(1'000 * kMsNs, 4'000 * kMsNs));
  EXPECT_THAT(silence_text("hair:1", {1}, 4'000 * kMsNs), testing::HasSubstr("not connected"));
}

TEST(ReconnectPolicy, ASilenceOfTheSameConnectionIsAnOutage) {
  ReconnectPolicy policy(1);
  policy.on_welcome(1'000 * kMsNs);
  policy.on_heard({2'000 * kMsNs}, 4'000 * kMsNs);
  EXPECT_EQ(policy.outage_s(4'000 * kMsNs), 0.0) << "it may still speak";
  policy.on_heard({2'000 * kMsNs}, 9'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(9'000 * kMsNs), 7.0, 1e-9);
  EXPECT_NEAR(policy.running_outage_s(9'000 * kMsNs), 7.0, 1e-9);
  policy.on_heard({10'000 * kMsNs}, 10'000 * kMsNs);  // it speaks again
  EXPECT_NEAR(policy.outage_s(20'000 * kMsNs), 8.0, 1e-9);
  EXPECT_EQ(policy.running_outage_s(20'000 * kMsNs), 0.0);
  EXPECT_EQ(policy.reconnects(), 0u);
  policy.on_heard({20'000 * kMsNs}, 25'000 * kMsNs);  // and not once more before it is lost
  (void)policy.on_lost(make_error(ErrorCode::Timeout, "nothing received"), 30'000 * kMsNs, 20'000 * kMsNs);
  policy.on_welcome(31'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(40'000 * kMsNs), 8.0 + 11.0, 1e-9) << "counted once";
}

TEST(ReconnectPolicy, ARelayThatHearsNothingIsNoConnection) {
  Heard heard{10'000 * kMsNs};
  hear(heard, 2.0, 10'000 * kMsNs);
  EXPECT_EQ(silent_since_ns(heard, 10'000 * kMsNs), 8'000 * kMsNs) << "the relay itself speaks";
  EXPECT_THAT(silence_text("relay:1", heard, 10'000 * kMsNs),
              testing::HasSubstr("to this relay from its server for 2 s"));
  ReconnectPolicy policy(1);
  policy.on_welcome(9'000 * kMsNs);
  policy.on_heard(heard, 10'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(10'000 * kMsNs), 1.0, 1e-9) << "before it came it had nothing to lose";
  // The relay is lost too.
  (void)policy.on_lost(make_error(ErrorCode::Unavailable, "reset"), 12'000 * kMsNs, 12'000 * kMsNs);
  EXPECT_NEAR(policy.outage_s(13'000 * kMsNs), 4.0, 1e-9);
  hear(heard, 0.0, 14'000 * kMsNs);
  EXPECT_EQ(silent_since_ns(heard, 10'001 * kMsNs), 0);
  hear(heard, 1e300, 14'000 * kMsNs);
  EXPECT_NE(silent_since_ns(heard, 14'000 * kMsNs), 0) << "any number of a server's";
}

/// The page has the same numbers: `name = 250` in its source, where underscores may stand in a number.
TEST(ReconnectPolicy, ThePageHasTheSameNumbers) {
  const auto text =
      load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "client/web/page/reconnect.ts", 1u << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  const auto number = [&](const std::string& name) {
    const size_t begin = text->find("const " + name + " = ");
    EXPECT_NE(begin, std::string::npos) << name;
    if (begin == std::string::npos) return 0.0;
    const size_t first = begin + name.size() + 9;
    std::string digits = text->substr(first, text->find(';', first) - first);
    std::erase(digits, '_');
    return std::stod(digits);
  };
  const auto ms = [](milliseconds duration) { return static_cast<double>(duration.count()); };
  EXPECT_EQ(number("FIRST_MS"), ms(kFirstReconnectDelay));
  EXPECT_EQ(number("LONGEST_MS"), ms(kLongestReconnectDelay));
  EXPECT_EQ(number("URGENT_MS"), ms(kLongestUrgentDelay));
  EXPECT_EQ(number("URGENT_ATTEMPTS"), kUrgentAttempts);
  EXPECT_EQ(number("JITTER"), kReconnectJitter);
  EXPECT_EQ(number("STABLE_MS"), ms(kStableConnection));
  EXPECT_EQ(number("DOUBTED_MS"), ms(kDoubtedServer));
  EXPECT_EQ(number("SILENT_MS"), ms(kSilentServer));
  const ClientConfig config;
  EXPECT_EQ(number("IDLE_MS"), ms(config.idle_timeout));
  EXPECT_EQ(number("WELCOME_MS"), ms(config.connect_timeout + config.welcome_timeout));
  EXPECT_EQ(number("TOKEN_BYTES"), static_cast<double>(kMaxTokenBytes));
  EXPECT_EQ(number("NAME_BYTES"), static_cast<double>(kMaxNameChars));
  const size_t begin = text->find("FINAL_CODES = [") + 15;
  std::istringstream codes(text->substr(begin, text->find(']', begin) - begin));
  std::set<uint16_t> of_page;
  for (int code = 0; codes >> code; codes.ignore(1)) of_page.insert(static_cast<uint16_t>(code));
  for (uint16_t code = 1000; code < 5000; ++code)
    EXPECT_EQ(of_page.contains(code), is_final(error_from_close(code, ""), Standing::Member)) << code;
}

enum class Fate { TryAgain, Stop };

/// What the protocol says of every code; the compiler asks for a new one.
Fate fate_of(CloseCode code) {
  switch (code) {
    case CloseCode::Normal:
    case CloseCode::GoingAway:
    case CloseCode::Internal:
    case CloseCode::TryLater:
    case CloseCode::BadData:
    case CloseCode::Policy:
    case CloseCode::TooBig:
    case CloseCode::Full:
      return Fate::TryAgain;
    case CloseCode::Unauthorized:
    case CloseCode::Kicked:
    case CloseCode::Refused:
    case CloseCode::NotFound:  // of a newcomer
      return Fate::Stop;
  }
  return Fate::Stop;
}

constexpr std::array kCloseCodes = {CloseCode::Normal,   CloseCode::GoingAway,    CloseCode::BadData,
                                    CloseCode::Policy,   CloseCode::TooBig,       CloseCode::Internal,
                                    CloseCode::TryLater, CloseCode::Unauthorized, CloseCode::Kicked,
                                    CloseCode::Full,     CloseCode::Refused,      CloseCode::NotFound};

TEST(ReconnectPolicy, DoesWithEveryCloseCodeWhatTheProtocolSays) {
  for (const CloseCode code : kCloseCodes) {
    const Error error = error_from_close(static_cast<uint16_t>(code), "The reason.");
    ReconnectPolicy policy(3);
    std::vector<int64_t> delays_ms;
    for (int attempt = 0; attempt < 4; ++attempt)
      if (const auto delay = policy.on_lost(error, kMsNs)) delays_ms.push_back(delay->count());
    EXPECT_THAT(error.message, testing::HasSubstr("The reason."));
    if (fate_of(code) == Fate::Stop) {
      EXPECT_TRUE(delays_ms.empty()) << static_cast<int>(code);
    } else {
      ASSERT_EQ(delays_ms.size(), 4u) << static_cast<int>(code);
      EXPECT_GT(delays_ms[3], delays_ms[0]) << "it waits longer every time";
    }
  }
}

/// Section 9 of the protocol: what a client does, by the first words of each row.
TEST(ReconnectPolicy, AgreesWithTheDocument) {
  const auto text = load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "proto/WIRE.md", 1u << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  std::map<uint16_t, Fate> documented;
  std::istringstream lines(text->substr(text->find("## 9. Close codes")));
  for (std::string line; std::getline(lines, line) && !line.starts_with("## 10");) {
    const size_t last = line.rfind('|', line.size() - 2);
    if (!line.starts_with("| ") || last == std::string::npos || !std::isdigit(line[2])) continue;
    const std::string action = line.substr(last + 2);
    std::istringstream codes(line.substr(2));
    for (int code = 0; codes >> code; codes.ignore(1))
      documented[static_cast<uint16_t>(code)] =
          action.starts_with("try again") || action.starts_with("nothing") ? Fate::TryAgain : Fate::Stop;
  }
  for (const CloseCode code : kCloseCodes) {
    ASSERT_TRUE(documented.contains(static_cast<uint16_t>(code))) << static_cast<int>(code);
    EXPECT_EQ(fate_of(code), documented[static_cast<uint16_t>(code)]) << static_cast<int>(code);
  }
}

TEST(ReconnectPolicy, TakesWhatItDoesNotKnowForPassing) {
  for (const uint16_t code : {0, 1002, 1003, 1006, 1012, 4999})
    EXPECT_TRUE(ReconnectPolicy(3).on_lost(error_from_close(code, ""), kMsNs)) << code;
  for (const ErrorCode code : {ErrorCode::BadInput, ErrorCode::LimitExceeded, ErrorCode::Unavailable,
                               ErrorCode::Timeout, ErrorCode::Internal})
    EXPECT_TRUE(ReconnectPolicy(3).on_lost(make_error(code, "no"), kMsNs));
  for (const ErrorCode code : {ErrorCode::Unauthorized, ErrorCode::Unsupported})
    EXPECT_FALSE(ReconnectPolicy(3).on_lost(make_error(code, "no"), kMsNs));
}

TEST(ReconnectPolicy, WhatDoesNotExistIsFinalToANewcomerAlone) {
  const Error gone = make_error(ErrorCode::NotFound, "HTTP 404");
  ReconnectPolicy policy(3);
  EXPECT_FALSE(policy.on_lost(gone, kMsNs));
  policy.on_welcome(2 * kMsNs);
  EXPECT_TRUE(policy.on_lost(gone, 3 * kMsNs)) << "it did exist";
  EXPECT_TRUE(policy.on_lost(gone, 4 * kMsNs));
}

TEST(Address, ReadsWhatPeopleType) {
  EXPECT_EQ(*parse_address("10.0.0.2:9000"), (Address{"10.0.0.2", 9000}));
  EXPECT_EQ(*parse_address("studio"), (Address{"studio", kDefaultPort}));
  EXPECT_EQ(*parse_address(":81"), (Address{"127.0.0.1", 81}));
  EXPECT_EQ(*parse_address("[::1]:82"), (Address{"::1", 82}));
  EXPECT_EQ(*parse_address("[::1]"), (Address{"::1", kDefaultPort}));
  EXPECT_EQ(*parse_address(""), Address{});
  EXPECT_EQ(*parse_address("wss://studio:83"), (Address{"studio", 83, true}));
  EXPECT_EQ(*parse_address("ws://[::1]:84"), (Address{"::1", 84, false}));
  EXPECT_EQ(parse_address("wss://[::1]:84")->to_string(), "[::1]:84");
  EXPECT_EQ((Address{"::1", 82}).to_string(), "[::1]:82");
}

TEST(Address, ASessionBehindAProxyHasAFolder) {
  const auto session = parse_address("wss://studio:83/s/anna-2.b");
  ASSERT_TRUE(session) << session.error().to_string();
  EXPECT_EQ(*session, (Address{"studio", 83, true, "anna-2.b"}));
  EXPECT_EQ(session->to_string(), "studio:83/s/anna-2.b");
  EXPECT_EQ(session->authority(), "studio:83");
  EXPECT_EQ(session->folder(), "/s/anna-2.b");
  EXPECT_EQ(*parse_address("studio:83/s/anna/"), (Address{"studio", 83, false, "anna"}));
  EXPECT_EQ(*parse_address("ws://studio:83/"), (Address{"studio", 83}));
  EXPECT_EQ((Address{"studio", 83}).folder(), "");
}

TEST(Address, RefusesTheRestAndNamesIt) {
  for (const char* text :
       {"host:", "host:0", "host:65536", "host:-1", "host:80x", "::1", "[::1", "[::1]80", "[::1]:", "a:b:c",
        "host:80/v1", "host:80/s/", "host:80/s/../v1", "host/s/a b", "host:80/s/a/b"}) {
    const auto parsed = parse_address(text);
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().code, ErrorCode::BadInput);
    EXPECT_NE(parsed.error().message.find(text), std::string::npos) << parsed.error().message;
  }
  EXPECT_FALSE(parse_address(std::string(10'000, 'a')));
}

}  // namespace
}  // namespace strandcast::client_net_test
