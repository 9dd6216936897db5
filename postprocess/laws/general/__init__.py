"""The law of any pin joint, made from solved joints, and the table that every law of one joint is
reduced to."""
