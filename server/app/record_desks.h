// RecordDesks: the recordings of all heads of a server together. Any thread.
#pragma once

#include <string>
#include <vector>

#include "server/app/record_desk.h"

namespace strandcast {

class RecordDesks {
 public:
  struct Of {
    std::string head;
    RecordDesk* desk;  // outlives this
  };

  /// Makes the group from the desks of several heads.
  explicit RecordDesks(std::vector<Of> all) : all_(std::move(all)) {}

  /// Starts or stops recording on every head. Replies once, with the answers of all desks; an error if one
  /// desk failed.
  void obey(const RecordCommand& command, const RecordDesk::Reply& reply) const;
  /// Describes the recordings of all heads like RecordDesk::text(); names the heads that are not recorded if
  /// some are.
  std::string text() const;

 private:
  std::vector<Of> all_;
};

}  // namespace strandcast
