// Where the tests find files: absolute folders, known when the project is configured. One object file holds
// them, so that the others come from a compiler cache wherever the project lies.
#pragma once

extern const char* const limber_source_dir;
extern const char* const limber_binary_dir;
extern const char* const limber_shared_data;  // with organs/ and dirty/; may not exist
