"""One loader a file format; each turns a file into a `RawFile` and interprets nothing."""
