"""Problems as input decks for other finite element programs: their `mesh`, and all that a `deck`
says of them."""
