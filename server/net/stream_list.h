// The streams of strands that there are, between a StreamList and what a server keeps. Pure functions, any
// thread.
#pragma once

#include <span>
#include <vector>

#include "common/wire/messages.h"
#include "server/net/strand_class.h"

namespace strandcast {

/// The first kMaxListedClasses of them.
std::vector<StreamList::Class> listed_classes(std::span<const StrandClass> classes);
/// At least one, whatever the list says.
std::vector<StrandClass> strand_classes_of(const StreamList& list);

}  // namespace strandcast
