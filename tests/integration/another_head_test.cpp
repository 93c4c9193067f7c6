// A viewer whose program makes another built-in head than the server's of the same form: it comes back by
// itself, is sent the mesh, and shows the same hair as anybody.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cstring>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "client/app/live_connection.h"
#include "common/strands/asset/layout.h"
#include "tests/support/server_fixture.h"

namespace strandcast {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

/// Bytes of a payload of layout 3 that name the hash of its head's mesh.
std::vector<char> head_hash_of(const std::vector<std::byte>& payload) {
  constexpr size_t kHeadBytes = 24, kHashBytes = 8;
  constexpr std::byte kFormPart{4};
  for (size_t at = kHeadBytes; at + 5 < payload.size();) {
    uint32_t size = 0;
    std::memcpy(&size, &payload[at + 1], sizeof size);
    std::vector<char> hash(kHashBytes);
    std::memcpy(hash.data(), &payload[at + 5], kHashBytes);
    if (payload[at] == kFormPart) return hash;
    at += 5 + size;
  }
  return {};
}

/// A link to a server on which the hash of a head becomes another one wherever it goes by.
class OtherHash {
 public:
  OtherHash(uint16_t to_port, std::vector<char> hash)
      : to_port_(to_port),
        hash_(std::move(hash)),
        acceptor_(context_, {asio::ip::make_address("127.0.0.1"), 0}) {
    accepting_ = std::thread([this] { accept(); });
  }
  ~OtherHash() {
    is_over_ = true;
    tcp::socket last(context_);  // which wakes the thread
    boost::system::error_code ignored;
    last.connect(acceptor_.local_endpoint(), ignored);
    accepting_.join();
    for (const auto& socket : sockets_) socket->shutdown(tcp::socket::shutdown_both, ignored);
    for (std::thread& thread : passing_) thread.join();
  }
  uint16_t port() const { return acceptor_.local_endpoint().port(); }
  int changed() const { return changed_; }

 private:
  enum class Way { Up, Down };
  void accept() {
    while (true) {
      auto near = std::make_shared<tcp::socket>(context_), far = std::make_shared<tcp::socket>(context_);
      boost::system::error_code failed;
      acceptor_.accept(*near, failed);
      if (is_over_ || failed) return;
      far->connect({asio::ip::make_address("127.0.0.1"), to_port_}, failed);
      if (failed) continue;
      sockets_.insert(sockets_.end(), {near, far});
      passing_.emplace_back([this, near, far] { pass(*near, *far, Way::Up); });
      passing_.emplace_back([this, near, far] { pass(*far, *near, Way::Down); });
    }
  }
  void pass(tcp::socket& from, tcp::socket& to, Way way) {
    const bool is_down = way == Way::Down;
    std::vector<char> held;  // not passed on yet: what may be the hash's beginning
    std::array<char, 16'384> read;
    boost::system::error_code ended, failed;
    while (!ended && !failed) {
      const size_t count = from.read_some(asio::buffer(read), ended);
      held.insert(held.end(), read.begin(), read.begin() + count);
      const auto found = std::search(held.begin(), held.end(), hash_.begin(), hash_.end());
      if (is_down && found != held.end()) {
        *found = static_cast<char>(*found ^ 1);
        ++changed_;
      }
      size_t kept = is_down && !ended ? std::min(held.size(), hash_.size() - 1) : 0;
      while (kept > 0 &&
             !std::equal(held.end() - static_cast<std::ptrdiff_t>(kept), held.end(), hash_.begin()))
        --kept;
      asio::write(to, asio::buffer(held.data(), held.size() - kept), failed);
      held.erase(held.begin(), held.end() - static_cast<std::ptrdiff_t>(kept));
    }
    boost::system::error_code ignored;
    from.shutdown(tcp::socket::shutdown_both, ignored);
    to.shutdown(tcp::socket::shutdown_both, ignored);
  }

  const uint16_t to_port_;
  const std::vector<char> hash_;
  asio::io_context context_;
  tcp::acceptor acceptor_;
  std::atomic<bool> is_over_{false};
  std::atomic<int> changed_{0};
  std::vector<std::shared_ptr<tcp::socket>> sockets_;
  std::vector<std::thread> passing_;
  std::thread accepting_;
};

using Hashes = std::map<uint64_t, uint64_t>;  // of states, by tick

void keep_hashes(ViewerSession& session, Hashes& hashes) {
  session.set_snapshot_listener([&hashes](const std::shared_ptr<const Snapshot>& snapshot) {
    hashes[snapshot->tick] = state_hash(*snapshot);
  });
}

class AnotherHead : public test::ServerFixture {
 protected:
  /// Of a viewer that steps; `port`: of a link, 0 = the server's own.
  ClientConfig stepping(uint16_t port = 0) const {
    ClientConfig config = client_config(StreamMode::Strands, Role::Viewer, port);
    config.hello.step_ns = 1e-3;
    return config;
  }
};

TEST_F(AnotherHead, IsMendedByTheMeshAndShowsTheSameHair) {
  constexpr size_t kSameStates = 30;
  constexpr uint64_t kMostFrameBytes = 90;  // of an exact frame
  ASSERT_TRUE(start(test::small_scene()));
  const auto plain = open(stepping());
  ASSERT_NE(plain, nullptr);
  ASSERT_TRUE(pump_until({plain.get()}, [&] { return plain->asset() != nullptr; }));
  ASSERT_NE(plain->asset()->head.form, nullptr) << "this one makes the server's head";
  const std::vector<char> hash = head_hash_of(encode_scene_asset(*plain->asset(), AssetLayout::Form));
  ASSERT_FALSE(hash.empty());
  Hashes expected, shown;
  keep_hashes(*plain, expected);

  OtherHash link(server_->port(), hash);
  auto live = LiveConnection::open(stepping(link.port()));
  ASSERT_TRUE(live) << live.error().to_string();
  const auto is_same = [&](const auto& state) {
    const auto at = expected.find(state.first);
    return at != expected.end() && at->second == state.second;
  };
  const auto same = [&] { return static_cast<size_t>(std::count_if(shown.begin(), shown.end(), is_same)); };
  EXPECT_TRUE(pump_until({plain.get()}, [&] {
    if ((*live)->pump(std::chrono::milliseconds(5))) {
      shown.clear();
      keep_hashes((*live)->session(), shown);
    }
    return (*live)->session().asset() != nullptr && same() >= kSameStates;
  })) << (*live)->trouble();

  EXPECT_EQ(link.changed(), 1) << "the second time no form comes";
  EXPECT_EQ((*live)->reconnects(), 1u);
  const SceneAsset* const mended = (*live)->session().asset();
  ASSERT_NE(mended, nullptr);
  EXPECT_EQ(mended->head.form, nullptr);
  EXPECT_EQ(mended->head.position_m, plain->asset()->head.position_m);
  EXPECT_EQ(mended->head.triangle, plain->asset()->head.triangle);
  for (const auto& [tick, hash_of_state] : shown) {
    const auto at = expected.find(tick);
    if (at != expected.end()) {
      EXPECT_EQ(at->second, hash_of_state) << tick;
    }
  }

  // Its hair is the simulation's own: nothing is told but the head's motion.
  const SessionTotals before = totals_of((*live)->session());
  EXPECT_TRUE(pump_until({plain.get()}, [&] {
    (*live)->pump(std::chrono::milliseconds(5));
    return totals_of((*live)->session()).decoded_frames >= before.decoded_frames + kSameStates;
  }));
  const SessionTotals after = totals_of((*live)->session());
  EXPECT_LE(after.received_bytes - before.received_bytes,
            kMostFrameBytes * (after.received_frames - before.received_frames));
}

}  // namespace
}  // namespace strandcast
