"""What a person says: queries, answers, what they say together, and what is imitated beside them."""
