// Ctrl-C as a request to stop at the next safe place.

#pragma once

namespace haarlight {

/// From here on SIGINT and SIGTERM set a flag; a second one ends the program at once, as usual.
/// SIGXFSZ is ignored: writes past a limit of size fail and are reported like a full disk.
void catch_interrupts();

/// Whether one has come since.
bool interrupted();

}  // namespace haarlight
