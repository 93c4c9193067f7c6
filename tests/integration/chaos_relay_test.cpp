// The relay between two sockets: data arrives whole, faults reach both ends.
#include "common/chaos/chaos_relay.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <thread>

#include "tests/support/eventually.h"

namespace strandcast::chaos::chaos_relay_test {
namespace {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;
using boost::system::error_code;

/// A client and a server socket with a relay between them; blocking, on one thread.
class Pair {
 public:
  explicit Pair(RelayConfig config = {}) {
    config.to_port = acceptor_.local_endpoint().port();
    auto started = ChaosRelay::start(config);
    EXPECT_TRUE(started) << started.error().to_string();
    relay = std::move(*started);
    client.connect({asio::ip::address_v4::loopback(), relay->port()});
    acceptor_.accept(server);
  }

 private:
  asio::io_context io_;
  tcp::acceptor acceptor_{io_, {asio::ip::address_v4::loopback(), 0}};

 public:
  std::unique_ptr<ChaosRelay> relay;
  tcp::socket client{io_}, server{io_};
};

std::string sample(size_t size) {
  std::string text(size, '\0');
  for (size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * 31 >> 2);
  return text;
}

/// Sends `text` one way while the other end reads to the end of the stream.
std::string carry(tcp::socket& from, tcp::socket& to, const std::string& text) {
  std::thread writer([&] {
    error_code ignored;
    asio::write(from, asio::buffer(text), ignored);
    from.shutdown(tcp::socket::shutdown_send, ignored);
  });
  std::string received;
  error_code error;
  asio::read(to, asio::dynamic_buffer(received), error);
  writer.join();
  EXPECT_EQ(error, asio::error::eof) << "the end of the stream must pass too";
  return received;
}

TEST(ChaosRelay, CarriesEverythingBothWaysInEveryWayOfWriting) {
  for (const Writes writes : {Writes::AsRead, Writes::OneByte, Writes::Split, Writes::Merged}) {
    RelayConfig config;
    config.up.writes = config.down.writes = writes;
    config.up.delay_us = 1'000;
    config.down.jitter_us = 2'000;
    Pair pair(config);
    const std::string text = sample(200'000);
    EXPECT_EQ(carry(pair.client, pair.server, text), text);
    EXPECT_EQ(carry(pair.server, pair.client, text), text);
    EXPECT_EQ(pair.relay->counters().bytes[0], text.size());
    EXPECT_EQ(pair.relay->counters().bytes[1], text.size());
    EXPECT_TRUE(eventually([&] { return pair.relay->counters().open_connections == 0; }));
  }
}

TEST(ChaosRelay, SlowLinkHoldsTheSenderBack) {
  RelayConfig config;
  config.down.bytes_per_s = 1'000'000;
  config.down.queue_bytes = 30'000;
  Pair pair(config);
  const std::string text = sample(300'000);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(carry(pair.server, pair.client, text), text);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(290))
      << "faster than the rate";
  EXPECT_LE(pair.relay->counters().most_queued_bytes, 30'000u + 2'000u);
}

TEST(ChaosRelay, ResetReachesBothEnds) {
  Pair pair;
  pair.relay->reset_all();
  char byte = 0;
  error_code error;
  asio::read(pair.client, asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::connection_reset);
  asio::read(pair.server, asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::connection_reset);
  EXPECT_EQ(pair.relay->counters().resets, 1u);
}

TEST(ChaosRelay, ResetAfterBytesCutsTheStream) {
  RelayConfig config;
  config.up.reset_after_bytes = 1'000;
  Pair pair(config);
  error_code error;
  asio::write(pair.client, asio::buffer(sample(1'000)), error);
  char byte = 0;
  asio::read(pair.client, asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::connection_reset);
}

TEST(ChaosRelay, SilenceSwallowsDataAndEnds) {
  Pair pair;
  pair.relay->set_silent(true);
  asio::write(pair.client, asio::buffer(sample(500)));
  EXPECT_TRUE(eventually([&] { return pair.relay->counters().swallowed_bytes[0] == 500; }));
  pair.client.close();
  give_time_to_misbehave();
  pair.server.non_blocking(true);
  char byte = 0;
  error_code error;
  pair.server.read_some(asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::would_block) << "the server must see neither data nor an end";
}

TEST(ChaosRelay, FreezePassesNothingUntilItEnds) {
  Pair pair;
  pair.relay->set_frozen(true);
  asio::write(pair.client, asio::buffer(sample(100)));
  give_time_to_misbehave();
  EXPECT_EQ(pair.relay->counters().bytes[0], 0u);
  pair.relay->set_frozen(false);
  std::string received(100, '\0');
  asio::read(pair.server, asio::buffer(received));
  EXPECT_EQ(received, sample(100));
}

TEST(ChaosRelay, ClientIsRefusedWhenTheServerIsAway) {
  RelayConfig config;
  {
    asio::io_context io;
    config.to_port = tcp::acceptor(io, {asio::ip::address_v4::loopback(), 0}).local_endpoint().port();
  }
  auto relay = ChaosRelay::start(config);
  ASSERT_TRUE(relay);
  asio::io_context io;
  tcp::socket client(io);
  client.connect({asio::ip::address_v4::loopback(), (*relay)->port()});
  char byte = 0;
  error_code error;
  asio::read(client, asio::buffer(&byte, 1), error);
  EXPECT_EQ(error, asio::error::connection_reset);
  EXPECT_TRUE(eventually([&] { return (*relay)->counters().refused == 1; }));
}

}  // namespace
}  // namespace strandcast::chaos::chaos_relay_test
