// For emscripten's linker: client/web/strand_core.mjs gives the core this one (client/web/fmt/format.h).
mergeInto(LibraryManager.library, { write_number: () => 0 });
