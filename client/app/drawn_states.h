// DrawnStates: states of another source, whose strands an export writes as viewers draw them. One thread.
#pragma once

#include <memory>

#include "client/export/export_source.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Returns the source with keys, followers, style and taper of a look. Errors of DrawnHair::make().
Result<std::unique_ptr<ExportSource>> as_drawn(std::unique_ptr<ExportSource> source, const LookDesc& look);

}  // namespace strandcast
