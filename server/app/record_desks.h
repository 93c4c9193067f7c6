// RecordDesks: the recordings of all heads of a server, for who looks at all of them. Any thread.
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

  /// Of several heads.
  explicit RecordDesks(std::vector<Of> all) : all_(std::move(all)) {}

  /// Begins a recording of each head, or ends those that there are. One answer, with what each desk said; an
  /// error where one was.
  void obey(const RecordCommand& command, const RecordDesk::Reply& reply) const;
  /// Of all that are recorded, as RecordDesk::text(); says which heads are not, where some are.
  std::string text() const;

 private:
  std::vector<Of> all_;
};

}  // namespace strandcast
