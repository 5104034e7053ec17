// Linked into programs that look for leaks: libraries stay loaded to the end (drivers of Mesa,
// modules of Open MPI), else nobody can tell afterwards whose memory it was that was left behind.

extern "C" int dlclose(void*) noexcept { return 0; }
